"""Pack the boxes of a CSV file, a placement at a time: 01_pack_a_csv.py [FILE.csv]."""

import csv
import sys
from pathlib import Path

from pack_planner import Box, pack

path = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name('cartons.csv')
with path.open(newline='') as file:
    boxes = [
        Box(
            row['id'],
            (float(row['length_mm']), float(row['width_mm']), float(row['height_mm'])),
            weight_kg=float(row['weight_kg']),
        )
        for row in csv.DictReader(file)
    ]

# bins of 120 x 80 x 80 cm; the algorithm sees five boxes at a time and has two open bins
packing = pack(boxes, '120x80x80', 'mpack_lite', look_ahead=5, open_bins=2, profile='paper')
for packed in packing:
    placed = packed.placed
    print(f'{placed.box.id:24} bin {packed.target.serial} at {placed.corner_mm} mm')

print(packing.figures)
arrays = packing.arrays()
print('highest top:', (arrays.corners + arrays.sizes)[:, 2].max(), 'mm')
print('broken rules:', packing.violations())
