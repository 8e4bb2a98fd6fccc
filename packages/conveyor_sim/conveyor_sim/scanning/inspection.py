"""What the induct's scanner, scale and gauge make of boxes, and what these really are.

Three views of one box: what rides on the belt (:meth:`Inspection.body`, two at once when they
touch: :func:`joint`), what is said of it (:meth:`Inspection.seen`), and how it lies
(:meth:`Inspection.true_pose`). ``scans`` is how often it was scanned: faults of a scan are gone
with the next one.
"""

from __future__ import annotations

from dataclasses import replace

from conveyor_sim.belt.tilt_tray import pose_on_tray
from conveyor_sim.scanning.fault import SOUND, Fault
from conveyor_sim.scanning.fault_plan import FaultPlan
from conveyor_sim.scanning.lie import BoxLies, Lie
from conveyor_sim.scanning.scanner import Scanner
from pack_msgs_py.geometry.pose import Pose, about_z, quaternion_product
from pack_msgs_py.values import Box

#: The checkweigher of the induct stops what is heavier, whatever arm stands behind it, kg.
MAX_WEIGHT_KG = 50.0
#: A box is scanned so often before it goes to the reject lane.
MAX_SCANS = 2


class Inspection:
    """See the module."""

    def __init__(
        self,
        scanner: Scanner | None = None,
        faults: FaultPlan | None = None,
        lies: BoxLies | None = None,
    ) -> None:
        self._scanner = scanner or Scanner()
        self._faults = faults or FaultPlan()
        self._lies = lies or BoxLies()

    @property
    def key(self) -> str:
        """Equal for inspections that say the same of the same stream."""
        noise = self._scanner.noise
        sigmas = (noise.size_mm, noise.weight_kg, noise.yaw_deg)
        return f'{self._faults.key}{sigmas if any(sigmas) else ""}{self._lies.key}'

    def body(self, box: Box, ordinal: int) -> Box:
        """The box as it really is."""
        return self._fault(ordinal).body(box, self._faults.rng(ordinal, 'body'))

    def refusal(self, body: Box) -> str:
        """Why the checkweigher stops a box; empty when it does not."""
        if body.weight_kg <= MAX_WEIGHT_KG:
            return ''
        return f'weighs {body.weight_kg:g} kg, at most {MAX_WEIGHT_KG:g} kg may ride'

    def has_label_of_last(self, ordinal: int) -> bool:
        """Whether the label of a box is that of the box before, if there is one."""
        return ordinal > 0 and self._fault(ordinal).has_label_of_last

    def read_at(self, ordinal: int) -> int | None:
        """At which scan a box is read; ``None`` when it is not read in :data:`MAX_SCANS`."""
        return self._fault(ordinal).read_at(self._faults.rng(ordinal, MAX_SCANS))

    def touches_next(self, ordinal: int) -> bool:
        """Whether the first scan takes this box and the next one for one."""
        return self._fault(ordinal).touches_next

    def falls(self, ordinal: int, scans: int) -> bool:
        """Whether a box falls off the belt."""
        return self._fault(ordinal, scans).falls

    def seen(self, body: Box, ordinal: int, scans: int) -> Box:
        """What the scanner says of a box, or of two that it takes for one."""
        fault = self._fault(ordinal, scans)
        misread = fault.misread(body, self._faults.rng(ordinal, 'misread'))
        return self._scanner.measure(misread, ordinal, scans)

    def true_pose(self, body: Box, ordinal: int, scans: int, up: str) -> Pose:
        """Where the centre really is once the box is at the pick point, axis ``up`` up.

        In frame `cell`.
        """
        straight = pose_on_tray(body.size_mm, up, 1.0)
        lies = self.lie(ordinal, scans).of(straight, body.size_mm)
        x, y, z = lies.position
        x += self._fault(ordinal, scans).slip_m(self._faults.rng(ordinal, 'slip'))
        yaw = about_z(self._scanner.yaw_rad(ordinal, scans))
        return Pose((x, y, z), quaternion_product(yaw, lies.quaternion))

    def lie(self, ordinal: int, scans: int) -> Lie:
        """How a box lies on the belt, which the scanner sees."""
        return self._lies.of(ordinal, scans)

    def _fault(self, ordinal: int, scans: int = 1) -> Fault:
        """What is wrong with a box that was scanned ``scans`` times."""
        fault = self._faults.of(ordinal) if scans == 1 else None
        return SOUND if fault is None else fault


def joint(first: Box, second: Box) -> Box:
    """Two boxes, one behind the other, as a scanner sees them that reads them as one."""
    (x, y, z), (x2, y2, z2) = first.size_mm, second.size_mm
    return replace(
        first,
        size_mm=(max(x, x2), y + y2, max(z, z2)),
        weight_kg=first.weight_kg + second.weight_kg,
        com_offset_mm=(0.0, 0.0, 0.0),
    )
