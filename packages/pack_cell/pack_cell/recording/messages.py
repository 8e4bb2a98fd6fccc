"""A message as it travelled, and the topic that it came on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class RecordedTopic:
    """A topic as a recording describes it.

    Attributes
    ----------
    name : with its namespace.
    type_name : such as `pack_msgs/msg/BoxScan`.
    definition : the text of the message and of every message in it.
    offered_qos : what each publisher offers, as rosbag2 writes it.
    type_hash : as REP 2016 defines it; empty when it is not known.
    """

    name: str
    type_name: str
    definition: str = ''
    offered_qos: tuple[Mapping[str, Any], ...] = field(default=(), hash=False)
    type_hash: str = ''

    @property
    def is_kept_for_late_joiners(self) -> bool:
        """Whether publishers keep what they said last."""
        return any(offer.get('durability') == 'transient_local' for offer in self.offered_qos)


@dataclass(frozen=True)
class RecordedMessage:
    """A message in CDR; heard and published so many nanoseconds since the epoch."""

    topic: RecordedTopic
    heard_ns: int
    published_ns: int
    data: bytes
