"""How many bins the same boxes would need without a belt, for the report alone.

Two figures, and what they are:

- a lower bound that is proven: the boxes have a volume and a weight, a bin has room for so much.
- what an offline packer needs (PackingSolver, Fontan and Libralesso 2020, by way of the package
  `packingsolver3d`): it knows all boxes, takes them in any order and with their true sizes, and
  leaves out margins, support and the arm. Its answer can be done so; fewer bins may do.

The packer works in a process of its own with a limit of time, so that whatever happens to it
happens to nothing else; without an answer there is no figure.
"""

from __future__ import annotations

import importlib.util
import json
import math
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from pack_msgs_py.orientation import allowed_orientations
from pack_msgs_py.profiles import Profile
from pack_msgs_py.values import BinSpec, Box

#: The packer's time, and what its process may take for all else, seconds.
PACKER_S, GRACE_S = 5.0, 10.0
#: It finds nothing in that time for many more boxes.
MOST_BOXES = 1000


@dataclass(frozen=True)
class OfflineBins:
    """Bins that some boxes need; ``packed`` is ``None`` where the packer gave no answer in time."""

    least: int
    packed: int | None = None


def offline_bins(
    boxes: Iterable[Box], spec: BinSpec, profile: Profile, limit_s: float = PACKER_S
) -> OfflineBins:
    """Both figures for ``boxes`` in bins of ``spec``.

    ``profile`` says which orientations are allowed and how much a bin may weigh. Boxes of different
    destinations never share a bin; for such, and for very many boxes, there is only the bound.
    """
    known: list[Box] = []
    needs: dict[str, tuple[float, float]] = {}
    for box in boxes:
        volume_mm3, weight_kg = needs.get(box.destination, (0.0, 0.0))
        needs[box.destination] = (volume_mm3 + box.volume_mm3, weight_kg + box.weight_kg)
        if len(known) <= MOST_BOXES:
            known.append(box)
    least = sum(_least_bins(*need, spec, profile) for need in needs.values())
    if len(needs) != 1 or len(known) > MOST_BOXES:
        return OfflineBins(least)
    packed = _ask_packer(_problem(known, spec, profile, limit_s), limit_s + GRACE_S)
    return OfflineBins(least, packed)


def _least_bins(volume_mm3: float, weight_kg: float, spec: BinSpec, profile: Profile) -> int:
    """No fewer bins hold so much."""
    shares = [volume_mm3 / math.prod(spec.size_mm)]
    if profile.max_bin_weight_kg is not None:
        shares.append(weight_kg / profile.max_bin_weight_kg)
    # what sums of floats are off must not ask for a bin of its own
    return math.ceil(max(shares) - 1e-9)


def _problem(
    boxes: Sequence[Box], spec: BinSpec, profile: Profile, limit_s: float
) -> dict[str, Any]:
    """What the packer is told: equal boxes once, sizes rounded up to whole millimetres."""
    kinds = Counter(
        (
            tuple(math.ceil(edge - 1e-6) for edge in box.size_mm),
            allowed_orientations(box, profile.orientations),
            box.weight_kg,
        )
        for box in boxes
    )
    return {
        'bin': spec.size_mm,
        'max_weight': profile.max_bin_weight_kg,
        'items': [[*kind, number] for kind, number in kinds.items()],
        'limit_s': limit_s,
    }


def _ask_packer(problem: dict[str, Any], timeout_s: float) -> int | None:
    if importlib.util.find_spec('packingsolver3d') is None:
        return None
    try:
        done = subprocess.run(
            [sys.executable, '-m', __name__],
            input=json.dumps(problem),
            capture_output=True,
            text=True,
            timeout=timeout_s,
            check=True,
        )
        # the solver writes to the same stream: the answer is the last line
        answer = json.loads(done.stdout.splitlines()[-1])
    except (OSError, subprocess.SubprocessError, ValueError, IndexError):
        return None
    return answer if isinstance(answer, int) and answer > 0 else None


def _pack(problem: dict[str, Any]) -> int | None:
    """Have the packer do it; ``None`` when it has not placed every box within its time."""
    from packingsolver3d import BinType, Instance, ItemType, Objective, Rotation, box

    length, breadth, height = problem['bin']
    count = sum(item[3] for item in problem['items'])
    limit = problem['max_weight']
    weights = {} if limit is None else {'maximum_weight': limit}
    instance = Instance(
        bin_types=[BinType(x=length, y=breadth, z=height, copies=count, **weights)],
        item_types=[
            ItemType(
                x=size[0], y=size[1], z=size[2], copies=number,
                weight=weight_kg, rotations=tuple(Rotation[turn.upper()] for turn in turns),
            )
            for size, turns, weight_kg, number in problem['items']
        ],
        objective=Objective.BIN_PACKING,
    )  # fmt: skip
    result = box.solve(instance, time_limit=problem['limit_s'])
    placed = sum(len(used.placements) * used.copies for used in result.bins)
    return int(result.number_of_bins) if placed == count else None


if __name__ == '__main__':
    print(json.dumps(_pack(json.load(sys.stdin))))
