"""Compare algorithms and look-aheads on the same random boxes."""

import random

from pack_planner import Box, pack

rng = random.Random(1)
boxes = [
    Box(f'box {number}', (rng.uniform(100, 500), rng.uniform(100, 400), rng.uniform(80, 300)))
    for number in range(100)
]

print(f'{"algorithm":12} {"look-ahead":>10} {"fill":>8} {"bins":>5} {"a decision":>11}')
for algorithm in ('first_fit', 'o_first_fit', 'mpack_lite', 'rollout'):
    for look_ahead in (1, 5):
        figures = pack(boxes, 'LDC', algorithm, look_ahead, open_bins=1).finish()
        print(
            f'{algorithm:12} {look_ahead:10} {figures.fill_closed:6.1f} % {figures.bins:5} '
            f'{1e3 * figures.decision_s["mean"]:8.2f} ms'
        )
