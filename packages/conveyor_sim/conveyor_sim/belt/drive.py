"""What every belt has in common: how fast it is driven, and what may ride on it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

from conveyor_sim.belt.loop import ride_refusal
from pack_msgs_py.values import Box


@dataclass
class Rider:
    """A box that rides, and how often it was passed over."""

    box: Box
    laps: int


class Drive(ABC):
    """Base of the belts.

    Parameters
    ----------
    along_m : longest box, along the belt, that may ride.
    belt_speed : m/s of robot time.
    speed : robot seconds per second of the time that calls are given.
    """

    _riders: Sequence[Rider | None]

    def __init__(self, along_m: float, belt_speed: float, speed: float) -> None:
        self._along_m = along_m
        self._belt_speed = belt_speed
        self._speed = speed
        self._paused = False

    @property
    def empty(self) -> bool:
        """Whether no box rides."""
        return all(rider is None for rider in self._riders)

    def set_motion(
        self,
        now_s: float,
        *,
        belt_speed: float | None = None,
        speed: float | None = None,
        paused: bool | None = None,
    ) -> None:
        """Change how the belt moves from now on."""
        self._advance(now_s)
        self._belt_speed = self._belt_speed if belt_speed is None else belt_speed
        self._speed = self._speed if speed is None else speed
        self._paused = self._paused if paused is None else paused

    def refusal(self, box: Box) -> str:
        """Why ``box`` cannot ride on this belt; empty when it can."""
        return ride_refusal(box, self._along_m)

    @abstractmethod
    def _advance(self, now_s: float) -> None:
        """Move everything to where it is at ``now_s``."""
