"""Run cases on this machine's processes or on a Dask cluster, and keep what is finished."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from pack_planner.bench.simulator import pack_collection
from pack_planner.bench.statistics import IDENTITY, identity, record
from pack_planner.bench.values import Case, JsonObject, Packed, Settings

CLUSTER_HELP = (
    '--cluster needs dask and distributed: install them with '
    "`./cell python -m pip install 'dask[distributed]'`"
)

_Unit = tuple[Case, Settings, int]


@dataclass(frozen=True)
class Workers:
    """Where collections are packed: ``jobs`` local processes, or a Dask scheduler's workers."""

    jobs: int = 1
    cluster: str = ''


class ResultFile:
    """Records in a JSON file and plans in a JSON Lines file, written as they are finished.

    Records that the file holds already are kept, and not computed again.

    Raises
    ------
    ValueError
        The file exists and does not hold records of the benchmark.
    """

    def __init__(self, json_path: Path | None, plan_path: Path | None) -> None:
        self._json, self._plan = json_path, plan_path
        self.records: list[JsonObject] = [] if json_path is None else _read_records(json_path)
        if plan_path is not None:
            self._keep_whole_plans(plan_path)
            _replace(plan_path, ''.join(self._plans_kept))

    def find(self, case: Case, settings: Settings) -> JsonObject | None:
        """The finished record of a case."""
        wanted = identity(case, settings)
        for one in self.records:
            if all(one.get(key) == value for key, value in wanted.items()):
                return one
        return None

    def add(self, finished: JsonObject, packed: Sequence[Packed]) -> None:
        """Write a finished record, its plan first."""
        if self._plan is not None:
            case = _plan_key(finished)
            with self._plan.open('a', encoding='utf-8') as file:
                for one in packed:
                    file.writelines(json.dumps({**event, **case}) + '\n' for event in one.events)
        self.records.append(finished)
        if self._json is not None:
            _replace(self._json, json.dumps(self.records, indent=1, allow_nan=False) + '\n')

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
        for one in self.records:
            plan = lines.get(_plan_key(one)['record'], [])
            if len(plan) == one['placed'] + one['closed_bins']:
                kept.append(one)
                self._plans_kept += plan
        self.records = kept


def run(
    cases: Sequence[Case],
    settings: Settings,
    workers: Workers,
    results: ResultFile,
    progress: Callable[[Case, int, int], None],
) -> list[JsonObject]:
    """The records of ``cases`` in their order; those that ``results`` holds are not run again.

    ``progress`` is called with the case, the collections of it that are done, and how many there
    are, after each collection.
    """
    todo = [case for case in cases if results.find(case, settings) is None]
    for case in cases:
        if case not in todo:
            progress(case, case.collections, case.collections)
    units = [(case, settings, number) for case in todo for number in range(case.collections)]
    with ExitStack() as stack:
        finished = _results(units, workers, stack)
        for case in todo:
            packed = []
            for number in range(case.collections):
                packed.append(next(finished))
                progress(case, number + 1, case.collections)
            results.add(record(case, settings, packed), packed)
    found = [results.find(case, settings) for case in cases]
    return [one for one in found if one is not None]


def _pack(unit: _Unit) -> Packed:
    return pack_collection(*unit)


def _results(units: list[_Unit], workers: Workers, stack: ExitStack) -> Iterator[Packed]:
    """What comes of ``units``, in their order."""
    if not workers.cluster and workers.jobs == 1:
        return map(_pack, units)
    from joblib import Parallel, delayed, parallel_config

    if workers.cluster:
        try:
            from distributed import Client
        except ImportError:
            raise ValueError(CLUSTER_HELP) from None
        try:
            client = stack.enter_context(Client(workers.cluster, timeout='10s'))
        except OSError as error:
            msg = f'--cluster {workers.cluster} does not answer: {error}'
            raise ValueError(msg) from None
        stack.enter_context(parallel_config(backend='dask', client=client))
        parallel = Parallel(n_jobs=-1, return_as='generator')
    else:
        parallel = Parallel(n_jobs=workers.jobs, return_as='generator', batch_size=1)
    finished: Iterator[Packed] = parallel(delayed(_pack)(unit) for unit in units)
    return finished


def _plan_key(finished: JsonObject) -> JsonObject:
    """What each plan line says of its record; ``record`` is a digest of what that is about."""
    about = {key: finished[key] for key in IDENTITY}
    digest = hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()[:12]
    return {**{key: finished[key] for key in ('algorithm', 'bin', 'look_ahead')}, 'record': digest}


def _read_records(path: Path) -> list[JsonObject]:
    if not path.exists() or not path.read_text(encoding='utf-8').strip():
        return []
    try:
        found = json.loads(path.read_text(encoding='utf-8'))
    except (OSError, ValueError) as error:
        msg = f'{path} exists and is not JSON ({error}): name another file'
        raise ValueError(msg) from None
    wanted = {*IDENTITY, 'placed', 'closed_bins', 'fill_closed', 'decision_s'}
    if not isinstance(found, list) or not all(
        isinstance(one, dict) and wanted <= one.keys() for one in found
    ):
        msg = f'{path} exists and holds no benchmark records: name another file'
        raise ValueError(msg)
    return found


def _replace(path: Path, text: str) -> None:
    """Write a file so that it is never half there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(path.name + '.part')
    draft.write_text(text, encoding='utf-8')
    os.replace(draft, path)
