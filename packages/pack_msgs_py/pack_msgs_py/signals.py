"""Signals that come before a node could handle them."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


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
