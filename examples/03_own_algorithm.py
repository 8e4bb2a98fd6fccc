"""A rule of your own: the box and the place that waste the least room, weighed in three numbers.

`./cell bench --algorithms examples/03_own_algorithm.py:snug,mpack_lite` compares it on many boxes,
`./cell run --algorithm examples/03_own_algorithm.py:snug` has the arm carry it out.
"""

import random

from pack_planner import Box, Choice, algorithm, all_spots, pack


@algorithm('snug')
def snug(problem):
    """Large boxes first, low and near the corner at the origin."""
    best = None
    for box in problem.boxes:
        for index, model in enumerate(problem.bins):
            # every allowed placement that matters, one a row
            spots = all_spots(problem.engine, box, model, problem.forbidden)
            if not len(spots):
                continue
            x, y, z = spots.corners.T
            scores = z + spots.sizes[:, 2] + 0.3 * (x + y) - 2e-5 * box.volume_mm3 + 500 * index
            row = int(scores.argmin())
            if best is None or scores[row] < best[0]:
                best = scores[row], spots.candidate(row, index, problem.engine)
    return None if best is None else Choice(best[1], reason=f'score {best[0]:.0f}')


if __name__ == '__main__':
    rng = random.Random(1)
    edges = [[rng.randrange(100, 450, 10) for _ in range(3)] for _ in range(120)]
    boxes = [Box(f'box {number}', tuple(map(float, size))) for number, size in enumerate(edges)]
    for rule in (snug, 'first_fit', 'mpack_lite'):
        name = rule if isinstance(rule, str) else rule.__name__
        print(f'{name}: {pack(boxes, "LDC", rule, look_ahead=4, open_bins=2).finish()}\n')
