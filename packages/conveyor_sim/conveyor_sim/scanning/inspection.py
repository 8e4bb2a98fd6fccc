"""What the induct's scanner, scale and gauge make of boxes, and what these really are.

Three views of one box: what rides on the belt (:meth:`Gate.body`, two at once when they touch),
what is said of it (:meth:`Gate.seen`), and how it lies (:meth:`Gate.true_pose`).
``scans`` is how often it was scanned: faults of a scan are gone with the next one.
"""

from __future__ import annotations

from conveyor_sim.belt.loop import loop_pose
from conveyor_sim.scanning.faults import Fault, FaultPlan
from conveyor_sim.scanning.scanner import Scanner
from pack_msgs_py.geometry.pose import Pose, about_z
from pack_msgs_py.values import Box

#: The checkweigher of the induct stops what is heavier, whatever arm stands behind it, kg.
MAX_WEIGHT_KG = 50.0


class Gate:
    """See the module."""

    def __init__(self, scanner: Scanner | None = None, faults: FaultPlan | None = None) -> None:
        self._scanner = scanner or Scanner()
        self._faults = faults or FaultPlan()

    @property
    def key(self) -> str:
        """Equal for gates that say the same of the same stream."""
        noise = self._scanner.noise
        sigmas = (noise.size_mm, noise.weight_kg, noise.yaw_deg)
        return f'{self._faults.key}{sigmas if any(sigmas) else ""}'

    def fault(self, ordinal: int, scans: int = 1) -> Fault | None:
        """What goes wrong with a box that was scanned ``scans`` times."""
        return self._faults.of(ordinal) if scans == 1 else None

    def body(self, box: Box, ordinal: int) -> Box:
        """The box as it really is."""
        return self._faults.body(box, ordinal)

    def refusal(self, body: Box) -> str:
        """Why the checkweigher stops a box; empty when it does not."""
        if body.weight_kg <= MAX_WEIGHT_KG:
            return ''
        return f'weighs {body.weight_kg:g} kg, at most {MAX_WEIGHT_KG:g} kg may ride'

    def scans_to_read(self, ordinal: int) -> int | None:
        """At which scan a box is read; ``None`` when it is not read in two."""
        if self.fault(ordinal) is not Fault.NO_READ:
            return 1
        return None if self._faults.unread(ordinal, 2) else 2

    def seen(self, body: Box, ordinal: int, scans: int) -> Box:
        """What the scanner says of a box, or of two that it takes for one."""
        if self.fault(ordinal, scans) is Fault.WRONG_SIZE:
            body = self._faults.misread(body, ordinal)
        return self._scanner.measure(body, ordinal, scans)

    def true_pose(self, body: Box, ordinal: int, scans: int, length_m: float) -> Pose:
        """Where the centre really is once the box stands at the pick point, frame `cell`."""
        x, y, z = loop_pose(0.0, length_m, body.size_mm).position
        if self.fault(ordinal, scans) is Fault.EMPTY_PICK:
            x += self._faults.slip_m(ordinal)
        return Pose((x, y, z), about_z(self._scanner.yaw_rad(ordinal, scans)))
