"""What the benchmark keeps on disk: records, plans, and what an interrupted run had packed."""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TextIO

from pack_cell.bench.statistics import IDENTITY, identity
from pack_cell.bench.values import BenchSettings, Case, JsonObject, Packed

#: What is added to the name of the records' file for collections of unfinished records.
UNFINISHED = '.unfinished'


class ResultFile:
    """Records in a JSON file and plans in a JSON Lines file, written as they are finished.

    Records that the file holds already are kept, and not computed again. Beside it each collection
    of a record that is not finished is kept as soon as it is packed.

    Raises
    ------
    ValueError
        The file exists and does not hold records of the benchmark, or another run writes it.
    """

    def __init__(self, json_path: Path | None, plan_path: Path | None) -> None:
        self._json, self._plan = json_path, plan_path
        self._parts = (
            None if json_path is None else json_path.with_name(json_path.name + UNFINISHED)
        )
        self._lock = None if json_path is None else claim(json_path)
        self.records: list[JsonObject] = [] if json_path is None else _read_records(json_path)
        if plan_path is not None:
            self._keep_whole_plans(plan_path)
            _replace(plan_path, ''.join(self._plans_kept))

    def close(self) -> None:
        """Let another run write the file."""
        if self._lock is not None:
            Path(self._lock.name).unlink(missing_ok=True)
            self._lock.close()

    def find(self, case: Case, settings: BenchSettings) -> JsonObject | None:
        """The finished record of a case."""
        wanted = identity(case, settings)
        for record in self.records:
            if all(record.get(key) == value for key, value in wanted.items()):
                return record
        return None

    def add(self, finished: JsonObject, packed: Sequence[Packed]) -> None:
        """Write a finished record, its plan first."""
        if self._plan is not None:
            case = _plan_key(finished)
            with self._plan.open('a', encoding='utf-8') as file:
                for collection in packed:
                    file.writelines(_line({**event, **case}) for event in collection.events)
        self.records.append(finished)
        if self._json is not None and self._parts is not None:
            _replace(self._json, json.dumps(self.records, indent=1, allow_nan=False) + '\n')
            left = [line for line in self._lines() if line['record'] != _digest(finished)]
            if left:
                _replace(self._parts, ''.join(map(_line, left)))
            else:
                self._parts.unlink(missing_ok=True)

    def keep(self, case: Case, settings: BenchSettings, number: int, packed: Packed) -> None:
        """Write down one collection of a record that is not finished yet."""
        if self._parts is None:
            return
        part = {'record': _digest(identity(case, settings)), 'number': number}
        whole = not self._parts.exists() or self._parts.read_bytes()[-1:] in (b'', b'\n')
        with self._parts.open('a', encoding='utf-8') as file:
            # the last line of one that was killed may be half there
            file.write(('' if whole else '\n') + _line({**part, 'packed': asdict(packed)}))

    def unfinished(self, case: Case, settings: BenchSettings) -> dict[int, Packed]:
        """The collections of a case that are packed already, by number."""
        wanted = _digest(identity(case, settings))
        return {
            line['number']: _packed(line['packed'])
            for line in self._lines()
            if line['record'] == wanted and line['number'] < case.collections
        }

    def _lines(self) -> list[JsonObject]:
        if self._parts is None or not self._parts.exists():
            return []
        parts = []
        for line in self._parts.read_text(encoding='utf-8').splitlines():
            try:
                part = json.loads(line)
                _packed(part['packed']), part['record'], part['number']
            except (ValueError, KeyError, TypeError):
                continue
            parts.append(part)
        return parts

    def _keep_whole_plans(self, path: Path) -> None:
        """Forget records without a whole plan, and plans without a record."""
        lines: dict[str, list[str]] = {}
        if self._json is not None and self.records and path.exists():
            for line in path.read_text(encoding='utf-8').splitlines():
                try:
                    key = json.loads(line)['record']
                except (ValueError, KeyError, TypeError):
                    continue
                lines.setdefault(key, []).append(line + '\n')
        kept = []
        self._plans_kept: list[str] = []
        for record in self.records:
            plan = lines.get(_plan_key(record)['record'], [])
            if len(plan) == record['placed'] + record['closed_bins']:
                kept.append(record)
                self._plans_kept += plan
        self.records = kept


def claim(path: Path) -> TextIO:
    """Two runs that write one file would each undo what the other has added."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lock = path.with_name(path.name + '.lock').open('w', encoding='utf-8')
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        lock.close()
        msg = f'{path} is being written by another run: wait for it, or name another file'
        raise ValueError(msg) from None
    return lock


def _plan_key(finished: JsonObject) -> JsonObject:
    """What each plan line says of its record; ``record`` is a digest of what that is about."""
    names = {key: finished[key] for key in ('algorithm', 'backend', 'bin', 'look_ahead')}
    return {**names, 'record': _digest(finished)}


def _digest(about: JsonObject) -> str:
    """Short name of what a record is about."""
    text = json.dumps({key: about[key] for key in IDENTITY}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def _line(part: JsonObject) -> str:
    return json.dumps(part) + '\n'


def _packed(values: JsonObject) -> Packed:
    """Inverse of ``asdict``; ``TypeError`` when something is missing."""
    lists = {key: tuple(values[key]) for key in ('events', 'unplaced', 'gaps')}
    return Packed(**{**values, **lists})


def _read_records(path: Path) -> list[JsonObject]:
    if not path.exists() or not path.read_text(encoding='utf-8').strip():
        return []
    try:
        records = json.loads(path.read_text(encoding='utf-8'))
    except (OSError, ValueError) as error:
        msg = f'{path} exists and is not JSON ({error}): name another file'
        raise ValueError(msg) from None
    wanted = {*IDENTITY, 'placed', 'closed_bins', 'fill_closed', 'decision_s'}
    if not isinstance(records, list) or not all(
        isinstance(record, dict) and wanted <= record.keys() for record in records
    ):
        msg = f'{path} exists and holds no benchmark records: name another file'
        raise ValueError(msg)
    return records


def _replace(path: Path, text: str) -> None:
    """Write a file so that it is never half there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(path.name + '.part')
    draft.write_text(text, encoding='utf-8')
    os.replace(draft, path)
