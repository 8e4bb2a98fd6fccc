"""Signals that come before a node could handle them, and interrupts that get lost."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


def signal_name(number: int) -> str:
    """Name of a signal; those that have none, such as the real-time ones, by their number."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f'signal {number}'


def _end(number: int, frame: FrameType | None) -> None:
    sys.exit(0)


@contextmanager
def signals_end_quietly() -> Iterator[None]:
    """SIGINT and SIGTERM end the process with code 0: nothing has begun that must be undone."""
    before = {number: signal.signal(number, _end) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def interrupts_kept() -> Iterator[Callable[[], None]]:
    """SIGINT is raised as ever, and once more by what this gives, called now and then.

    Python drops an exception that a signal raises while it frees an object or runs a callback of
    compiled code. Only for the main thread.
    """
    came = False

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal came
        came = True
        raise KeyboardInterrupt

    def look() -> None:
        if came:
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, handle)
    try:
        yield look
    finally:
        signal.signal(signal.SIGINT, before)
