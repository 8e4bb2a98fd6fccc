"""What a call of the conveyor changed, and how the belt is worked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from conveyor_sim.belt.jams import Jams, find_jams
from conveyor_sim.induct.arrivals import Arrivals, find_arrivals
from conveyor_sim.scanning.inspection import Inspection
from pack_msgs_py.cell_values import BoxEvent


@dataclass(frozen=True)
class Outcome:
    """Whether the scan is another, events to publish, news for people.

    ``repeated`` are events of an earlier run, for those who were not there; ``complaints`` say
    what in a message made no sense.
    """

    changed: bool = False
    events: tuple[BoxEvent, ...] = ()
    repeated: tuple[BoxEvent, ...] = ()
    notes: tuple[str, ...] = ()
    complaints: tuple[str, ...] = ()


@dataclass(frozen=True)
class Plan:
    """When boxes come, what is made of them, when the belt jams, how often one may be passed over.

    ``max_laps`` is 0 for any number; ``speed`` is robot seconds per second.
    """

    arrivals: Arrivals = field(default_factory=lambda: find_arrivals('saturated'))
    jams: Jams = field(default_factory=lambda: find_jams(''))
    max_laps: int = 0
    inspection: Inspection = field(default_factory=Inspection)
    speed: float = 1.0


def merged(outcomes: Sequence[Outcome]) -> Outcome:
    """What several calls changed together."""
    return Outcome(
        any(one.changed for one in outcomes),
        tuple(event for one in outcomes for event in one.events),
        notes=tuple(note for one in outcomes for note in one.notes),
        complaints=tuple(text for one in outcomes for text in one.complaints),
    )
