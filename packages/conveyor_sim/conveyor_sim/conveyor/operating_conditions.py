"""How a belt is worked."""

from __future__ import annotations

from dataclasses import dataclass, field

from conveyor_sim.belt.jams import Jams, find_jams
from conveyor_sim.induct.arrivals import Arrivals, find_arrivals
from conveyor_sim.scanning.inspection import Inspection


@dataclass(frozen=True)
class OperatingConditions:
    """When boxes come, what is made of them, when the belt jams, how often one may be passed over.

    ``max_laps`` is 0 for any number; ``speed`` is robot seconds per second.
    """

    arrivals: Arrivals = field(default_factory=lambda: find_arrivals('saturated'))
    jams: Jams = field(default_factory=lambda: find_jams(''))
    max_laps: int = 0
    inspection: Inspection = field(default_factory=Inspection)
    speed: float = 1.0
