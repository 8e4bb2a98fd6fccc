"""What counts as a fault, and the folder in which each one is kept."""

from __future__ import annotations

import json
import shutil
import sqlite3
from collections.abc import Iterable, Mapping
from contextlib import closing
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from pack_cell.recording.mcap_file import write_mcap
from pack_cell.recording.messages import RecordedMessage
from pack_msgs_py.cell_values import BoxEvent, Report
from pack_msgs_py.codes import BoxEventKind, ErrorCode, Mode

#: Folder of the faults, beside the journals.
FAULTS_FOLDER = 'faults'
LAST_SECONDS, NODES_FILE = 'last_seconds.mcap', 'nodes.json'
#: Of each code the first fault is kept, and so many of the last ones.
KEPT_PER_CODE = 5
#: A fault of a code is kept at most so often, seconds.
BETWEEN_S = 5.0
#: Larger journals are left out: they are where they were, beside the folder.
MOST_JOURNAL_BYTES = 50_000_000

_FAULTY_MODES = (Mode.PROTECTIVE_STOP, Mode.FAULT)
_FAULTY_EVENTS = (BoxEventKind.LOST, BoxEventKind.UNKNOWN)


def fault_of_report(report: Report) -> str:
    """Code of the fault that a goal ended with; empty when nothing went wrong in motion."""
    if report.code in (ErrorCode.CANCELED, ErrorCode.NONE):
        return ''
    in_motion = report.code >= ErrorCode.GRASP_FAILED or report.code is ErrorCode.UNKNOWN
    return report.code.name if in_motion else ''


def fault_of_event(event: BoxEvent) -> str:
    """Code of what happened to a box; empty unless nobody knows where it is."""
    return f'BOX_{event.event.name}' if event.event in _FAULTY_EVENTS else ''


def fault_of_mode(mode: Mode) -> str:
    """Code of a mode of the arm that needs a person; else empty."""
    return f'ARM_{mode.name}' if mode in _FAULTY_MODES else ''


class FaultFolders:
    """Keeps faults in ``state/faults/CODE/TIME/``."""

    def __init__(self, state: Path) -> None:
        self._state = state
        self._last_s: dict[str, float] = {}

    def is_due(self, code: str, now_s: float) -> bool:
        """Whether a fault of that code is to be kept; ``now_s`` of a steady clock."""
        last_s = self._last_s.get(code)
        if last_s is not None and now_s - last_s < BETWEEN_S:
            return False
        self._last_s[code] = now_s
        return True

    def keep(
        self, code: str, messages: Iterable[RecordedMessage], nodes: Mapping[str, Any]
    ) -> Path:
        """Write ``messages``, what is known of the ``nodes``, and copies of their journals.

        Returns
        -------
        Path
            The folder of the fault.

        Raises
        ------
        OSError
            It cannot be written.
        """
        of_code = self._state / FAULTS_FOLDER / code
        folder = of_code / datetime.now(timezone.utc).strftime('%Y%m%d-%H%M%S.%f')[:-3]
        folder.mkdir(parents=True, exist_ok=True)
        write_mcap(folder / LAST_SECONDS, messages)
        (folder / NODES_FILE).write_text(json.dumps(nodes, indent=2) + '\n')
        for journal in self._state.glob('*.sqlite'):
            _copy_journal(journal, folder / journal.name)
        kept = sorted(of_code.iterdir())
        for old in kept[1:-KEPT_PER_CODE]:
            shutil.rmtree(old, ignore_errors=True)
        return folder


def _copy_journal(journal: Path, copy: Path) -> None:
    """Copy a database that its owner goes on writing; one that cannot be read is left out."""
    if journal.stat().st_size > MOST_JOURNAL_BYTES:
        return
    try:
        try:
            _back_up(journal, copy)
        except sqlite3.OperationalError:
            _copy_held(journal, copy)
    except (OSError, sqlite3.Error):
        copy.unlink(missing_ok=True)


def _back_up(journal: Path, copy: Path) -> None:
    """The way of SQLite; raises at once where the owner lets nobody else read."""
    with (
        closing(sqlite3.connect(f'file:{journal}?mode=ro', uri=True, timeout=0.0)) as source,
        closing(sqlite3.connect(copy)) as target,
    ):
        # Without this a backup waits for as long as the owner holds the file, a whole run.
        source.execute('BEGIN')
        source.execute('SELECT count(*) FROM sqlite_master').fetchone()
        source.backup(target)


def _copy_held(journal: Path, copy: Path) -> None:
    """Copy the files of a database that its owner alone may open.

    The write-ahead log first: what is moved from it into the database meanwhile is in both then.
    """
    log = copy.with_name(f'{copy.name}-wal')
    for end in ('-wal', ''):
        if (source := journal.with_name(journal.name + end)).exists():
            shutil.copyfile(source, copy.with_name(copy.name + end))
    try:
        with closing(sqlite3.connect(copy)) as db:
            if db.execute('PRAGMA quick_check').fetchone() != ('ok',):
                msg = f'{journal} was written while it was copied'
                raise sqlite3.DatabaseError(msg)
    finally:
        log.unlink(missing_ok=True)
