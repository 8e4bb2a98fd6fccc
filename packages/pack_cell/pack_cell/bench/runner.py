"""Run cases on this machine's processes or on a Dask cluster."""

from __future__ import annotations

import os
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import lru_cache
from typing import cast

from pack_cell.bench.cluster import dask_cluster
from pack_cell.bench.results import ResultFile
from pack_cell.bench.simulator import pack_collection
from pack_cell.bench.statistics import record
from pack_cell.bench.values import BenchSettings, Case, JsonObject, Packed

_Unit = tuple[Case, BenchSettings, int]

#: How often a worker looks whether its run is still there.
_PARENT_PERIOD_S = 2.0


@dataclass(frozen=True)
class Workers:
    """Where collections are packed: ``jobs`` local processes, or a Dask scheduler's workers.

    ``note`` is told what someone who waits should know.
    """

    jobs: int = 1
    cluster: str | None = None
    note: Callable[[str], None] = lambda _: None


def run(
    cases: Sequence[Case],
    settings: BenchSettings,
    workers: Workers,
    results: ResultFile,
    progress: Callable[[Case, int, int], None],
) -> list[JsonObject]:
    """The records of ``cases`` in their order; what ``results`` holds is not run again.

    ``progress`` is called with the case, the collections of it that are done, and how many there
    are, after each collection.
    """
    todo = [case for case in cases if results.find(case, settings) is None]
    for case in cases:
        if case not in todo:
            progress(case, case.collections, case.collections)
    kept = {case: results.unfinished(case, settings) for case in todo}
    units = [
        (case, settings, number)
        for case in todo
        for number in range(case.collections)
        if number not in kept[case]
    ]
    with ExitStack() as stack:
        finished = _results(units, workers, stack)
        for case in todo:
            packed = []
            for number in range(case.collections):
                known = kept[case].get(number)
                collection = next(finished) if known is None else known
                if known is None:
                    results.keep(case, settings, number, collection)
                packed.append(collection)
                progress(case, number + 1, case.collections)
            results.add(record(case, settings, packed), packed)
    records = (results.find(case, settings) for case in cases)
    return [finished for finished in records if finished is not None]


def _pack(unit: _Unit) -> Packed:
    return pack_collection(*unit)


def _pack_here(unit: _Unit) -> Packed:
    """The same in a process of this run."""
    _end_with_parent()
    return _pack(unit)


@lru_cache(maxsize=1)
def _end_with_parent() -> None:
    """A worker of joblib would wait for ever for the next task of a run that was killed."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_PARENT_PERIOD_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _results(units: list[_Unit], workers: Workers, stack: ExitStack) -> Iterator[Packed]:
    """What comes of ``units``, in their order."""
    if workers.cluster is None and workers.jobs == 1:
        return map(_pack, units)
    from joblib import Parallel, delayed

    if workers.cluster is not None:
        stack.enter_context(dask_cluster(workers.cluster, workers.note))
        parallel, pack = Parallel(n_jobs=-1, return_as='generator'), _pack
    else:
        pack = _pack_here
        parallel = Parallel(n_jobs=workers.jobs, return_as='generator', batch_size=1)
    finished: Iterator[Packed] = parallel(delayed(pack)(unit) for unit in units)
    stack.callback(_give_up, finished)
    return finished


def _give_up(finished: Iterator[Packed]) -> None:
    """Cancel what is not packed yet, without the advice that joblib has for that."""
    with warnings.catch_warnings():
        warnings.filterwarnings('ignore', category=UserWarning, module='joblib')
        cast('Generator[Packed]', finished).close()
