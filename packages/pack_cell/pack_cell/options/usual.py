"""What a cell does when nobody says: by profile, and by what its belt and its robot allow."""

from __future__ import annotations

from pathlib import Path

from arm_executor.model.layout import LayoutError
from arm_executor.reach.layout_file import find_layout
from pack_msgs_py.orientation import TRAY_HEIGHT_MM, UPRIGHT_OR_TIPPED

#: Error of the scanner by profile: what one can buy, and none, as in the paper.
SCAN_SIGMA_MM = {'cell': 2.0, 'dense': 2.0, 'paper': 0.0}
#: What else is off when the sizes are, in kilograms and degrees.
SCAN_SIGMA_KG, SCAN_SIGMA_DEG = 0.02, 0.3
#: Orientation rule of planner and executor by the faces that the arm takes boxes by.
GRASP_FACES = {'top': 'upright', 'any': 'upright_or_front_up', 'tray': UPRIGHT_OR_TIPPED}
#: By which faces boxes are taken, by profile.
USUAL_FACES = {'cell': 'tray', 'dense': 'tray', 'paper': 'top'}
#: Which algorithm packs, by profile: what fills most under it (docs/benchmarks/execution.md).
USUAL_ALGORITHM = {'cell': 'foresight', 'dense': 'foresight', 'paper': 'rollout'}


def usual_faces(profile: str, belt_mode: str, layout: Path | None, robot: str) -> str:
    """The key of :data:`GRASP_FACES` for a cell that nobody gave one; ``layout`` is a file.

    Those of :data:`USUAL_FACES`, but ``top`` where no tray can stand. A layout that cannot be read
    is no matter here: who builds the cell refuses it.
    """
    faces = USUAL_FACES[profile]
    if faces != 'tray':
        return faces
    if belt_mode == 'continuous':
        return 'top'
    try:
        room_mm = 1000 * find_layout(str(layout) if layout else '', robot).conveyor.tallest_box
    except LayoutError:
        return faces
    return faces if room_mm >= TRAY_HEIGHT_MM else 'top'
