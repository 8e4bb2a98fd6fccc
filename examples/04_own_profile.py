"""Packing rules of your own: what standing safely costs."""

import random

from pack_planner import PROFILES, Box, Profile, pack

rng = random.Random(2)
boxes = [
    Box(f'box {number}', (rng.uniform(150, 450), rng.uniform(120, 350), rng.uniform(80, 300)))
    for number in range(120)
]

careful = Profile(
    'careful',
    resolution_mm=5,  # grid of positions
    clearance_mm=6.0,  # air between neighbours
    orientations='upright',  # boxes only turn about the vertical
    min_vertices=4,  # all four corners of the base rest on something
    min_support_share=0.75,  # and three quarters of its area
    com_margin_mm=20.0,  # the centre of mass lies well inside what carries it
)
for profile in (PROFILES['paper'], PROFILES['cell'], careful):
    packing = pack(boxes, 'LDC', 'mpack_lite', look_ahead=5, open_bins=2, profile=profile)
    print(f'{profile.name}: {packing.finish()}')
    print(f'broken rules: {packing.violations()}\n')
