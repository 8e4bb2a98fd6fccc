"""What a call of the conveyor changed, for those who tell the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pack_msgs_py.cell_values import BoxEvent


@dataclass(frozen=True)
class ConveyorNews:
    """Whether the scan is another, events to publish, notes for people.

    ``repeated`` are events of an earlier run, for those who were not there; ``complaints`` say
    what in a message made no sense.
    """

    changed: bool = False
    events: tuple[BoxEvent, ...] = ()
    repeated: tuple[BoxEvent, ...] = ()
    notes: tuple[str, ...] = ()
    complaints: tuple[str, ...] = ()


def merged(news: Sequence[ConveyorNews]) -> ConveyorNews:
    """What several calls changed together."""
    return ConveyorNews(
        any(each.changed for each in news),
        tuple(event for each in news for event in each.events),
        notes=tuple(note for each in news for note in each.notes),
        complaints=tuple(text for each in news for text in each.complaints),
    )
