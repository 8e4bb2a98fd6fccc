"""Draw the first bin of a packing: 05_draw_a_bin.py [FILE.png]; needs matplotlib."""

import random
import sys

from pack_planner import Box, draw_bin, pack

rng = random.Random(3)
edges = [[rng.randrange(150, 450, 10) for _ in range(3)] for _ in range(60)]
boxes = [Box(str(number), tuple(map(float, size))) for number, size in enumerate(edges)]

packing = pack(boxes, 'LDC', 'rollout', look_ahead=5, open_bins=1)
packing.finish()
file = sys.argv[1] if len(sys.argv) > 1 else 'bin.png'
draw_bin(packing.bins[0], file, names=True)
print(f'drew {len(packing.bins[0].boxes)} boxes into {file}')
