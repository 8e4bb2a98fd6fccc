"""Run cases on this machine's processes or on a Dask cluster."""

from __future__ import annotations

import os
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, TypeVar, cast

from pack_cell.bench.cluster import dask_cluster
from pack_cell.bench.results import ResultFile
from pack_cell.bench.simulator import pack_collection
from pack_cell.bench.statistics import record
from pack_cell.bench.values import BenchSettings, Case, JsonObject, Packed

_Unit = tuple[Case, BenchSettings, int]
U = TypeVar('U')
R = TypeVar('R')

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
        finished = spread(_pack, units, workers, stack)
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


def _here(work: Callable[[U], R], unit: U) -> R:
    """``work`` in a process of this run."""
    _end_with_parent()
    return work(unit)


@lru_cache(maxsize=1)
def _end_with_parent() -> None:
    """A worker of joblib would wait for ever for the next task of a run that was killed."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_PARENT_PERIOD_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def spread(
    work: Callable[[U], R], units: Iterable[U], workers: Workers, stack: ExitStack
) -> Iterator[R]:
    """What ``work`` makes of each of ``units``, in their order.

    Parameters
    ----------
    work : a function of a module, so that other processes know it.
    units : what it is given, one at a time.
    workers : where.
    stack : what has to be closed when no more results are wanted is put on it.
    """
    if workers.cluster is None and workers.jobs == 1:
        return map(work, units)
    from joblib import Parallel, delayed

    if workers.cluster is not None:
        stack.enter_context(dask_cluster(workers.cluster, workers.note))
        parallel, there = Parallel(n_jobs=-1, return_as='generator'), work
    else:
        there = partial(_here, work)
        parallel = Parallel(n_jobs=workers.jobs, return_as='generator', batch_size=1)
    finished: Iterator[R] = parallel(delayed(there)(unit) for unit in units)
    stack.callback(_give_up, finished)
    return finished


def _give_up(finished: Iterator[Any]) -> None:
    """Cancel what is not done yet, without the advice that joblib has for that."""
    with warnings.catch_warnings():
        warnings.filterwarnings('ignore', category=UserWarning, module='joblib')
        cast('Generator[Any]', finished).close()
