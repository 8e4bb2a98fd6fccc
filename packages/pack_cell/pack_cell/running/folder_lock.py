"""One `cell run` at a time works in a folder, and no node of an earlier one still does."""

from __future__ import annotations

import fcntl
import os
import sqlite3
import time
from pathlib import Path

from arm_executor.bins.journal import FILE_NAME as JOURNAL
from conveyor_sim.ledger.ledger import FILE_NAME as LEDGER

#: Nodes whose `cell run` was killed end within so many seconds.
NODES_END_S = 10.0
_LOOK_AGAIN_S = 0.1


class FolderTaken(RuntimeError):
    """Another process works in the folder; the text says which part of it is held."""


class FolderLock:
    """Holds the folder ``state`` of a run, which is made if it is missing, until :meth:`release`.

    Raises
    ------
    FolderTaken
        Another `cell run` holds it, or nodes that have lost theirs do not end.
    OSError
        The folder cannot be made or written.
    """

    def __init__(self, state: Path) -> None:
        state.mkdir(parents=True, exist_ok=True)
        self._fd = _locked(state / 'run.lock')
        if self._fd is None:
            msg = f'another cell run works in {state.parent}'
            raise FolderTaken(msg)
        end = time.monotonic() + NODES_END_S
        while (held := _held_by_node(state)) and time.monotonic() < end:
            time.sleep(_LOOK_AGAIN_S)
        if held:
            self.release()
            msg = f'{held} is still in use by a node that outlives its cell run: end that process'
            raise FolderTaken(msg)

    def release(self) -> None:
        """Let others work in the folder."""
        if self._fd is not None:
            os.close(self._fd)
            self._fd = None


def _locked(path: Path) -> int | None:
    """A descriptor that locks the file at ``path``; ``None`` when another process does."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        return None
    return descriptor


def _held_by_node(state: Path) -> Path | None:
    """The book that a node still has open; ``None`` when none does."""
    lock = (state / JOURNAL).with_suffix('.lock')
    if lock.exists():
        descriptor = _locked(lock)
        if descriptor is None:
            return state / JOURNAL
        os.close(descriptor)
    if (state / LEDGER).exists():
        db = sqlite3.connect(state / LEDGER, isolation_level=None, timeout=0.0)
        try:
            db.execute('BEGIN IMMEDIATE')
            db.execute('ROLLBACK')
        except sqlite3.OperationalError as error:
            if 'locked' in str(error):
                return state / LEDGER
        except sqlite3.DatabaseError:
            pass  # whoever opens it says what is wrong with it
        finally:
            db.close()
    return None
