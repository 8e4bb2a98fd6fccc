"""Keeps the logs of a long run small."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

#: A log is put aside when it has grown to so much, and so many of those are kept.
MOST_BYTES, KEPT = 10_000_000, 3


def rotate(log: Path, most_bytes: int = MOST_BYTES, kept: int = KEPT) -> bool:
    """Put a log aside that has grown too long, as ``NAME.log.1``; whether it had.

    A process goes on writing to it: it must have opened it for appending. What it writes just
    between the copy and the cut is lost, as with `copytruncate` of logrotate.
    """
    try:
        if log.stat().st_size < most_bytes:
            return False
        for number in range(kept - 1, 0, -1):
            older = log.with_name(f'{log.name}.{number}')
            if older.exists():
                older.replace(log.with_name(f'{log.name}.{number + 1}'))
        shutil.copy2(log, log.with_name(f'{log.name}.1'))
        os.truncate(log, 0)
    except OSError:
        return False  # on a full disk a long log is the smaller trouble
    return True
