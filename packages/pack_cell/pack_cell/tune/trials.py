"""Trials: a stream packed with certain weights, on all processes, each once and kept in a file."""

from __future__ import annotations

import json
from collections.abc import Callable, Generator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from pack_cell.bench.options import MAX_BUDGET_S
from pack_cell.bench.results import claim
from pack_cell.bench.runner import Workers, spread
from pack_cell.tune.streams import stream_boxes
from pack_cell.tune.values import Trial, TuneSettings, Weighting
from pack_planner import pack
from pack_planner.algorithms.tuned_weights import TunedEntry, TunedTable

#: What is added to the name of the parameter file for the trials that were made for it.
TRIALS = '.trials'


def tuned_entry(
    settings: TuneSettings, weights: Weighting, made: dict[str, Any] | None = None
) -> TunedEntry:
    """``weights`` with what they are for."""
    from pack_planner.algorithms import find_algorithm

    return TunedEntry(
        find_algorithm(settings.algorithm).name,
        settings.bin_spec.name,
        settings.bin_spec.size_mm,
        settings.profile.name,
        settings.profile.orientations,
        weights,
        made or {},
    )


@dataclass(frozen=True)
class _Task:
    settings: TuneSettings
    trial: Trial


def closed_fill(task: _Task) -> float:
    """Mean fill of the bins that are closed in a trial, percent; 0 with weights that place nothing.

    Raises
    ------
    ValueError
        None is closed because there are too few boxes.
    """
    settings, trial = task.settings, task.trial
    packing = pack(
        stream_boxes(settings, trial.part, trial.number),
        settings.bin_spec,
        settings.algorithm,
        settings.look_ahead,
        settings.open_bins,
        settings.profile,
        # a search that time cuts short would not be the same again
        budget_s=MAX_BUDGET_S,
        tuned=TunedTable((tuned_entry(settings, trial.weights),)),
    )
    fill = packing.finish().fill_closed
    if fill is None and packing.unplaced:
        return 0.0
    if fill is None:
        msg = (
            f'boxes {settings.boxes[trial.number % len(settings.boxes)]!r} close no '
            f'{settings.bin_spec.name} bin: raise --stream-bins, now {settings.stream_bins:g}'
        )
        raise ValueError(msg)
    return fill


class TrialBook:
    """Makes trials; what it has made, it and a later run of the same tuning know.

    Raises
    ------
    ValueError
        The file exists and is of a tuning with other settings, or another run writes it.
    """

    def __init__(
        self,
        settings: TuneSettings,
        workers: Workers,
        path: Path | None,
        look: Callable[[], None] = lambda: None,
    ) -> None:
        """``path`` is where trials are kept, or ``None``; ``look`` is called after each of them."""
        self._settings, self._workers, self._look = settings, workers, look
        self._known: dict[Trial, float] = {}
        self._lock = None if path is None else claim(path)
        self._file: TextIO | None = None
        if path is not None:
            self._read(path)
            self._file = path.open('a', encoding='utf-8')
            if not path.stat().st_size:
                self._write({'tuning': settings.identity})
        #: Trials that a run before had made.
        self.kept = len(self._known)

    def close(self) -> None:
        """Let another run go on with the file."""
        if self._file is not None:
            self._file.close()
        if self._lock is not None:
            Path(self._lock.name).unlink(missing_ok=True)
            self._lock.close()

    def fills(self, trials: Sequence[Trial]) -> Generator[float, None, None]:
        """What comes of ``trials``, in their order, each as soon as those before it are made."""
        new = [trial for trial in dict.fromkeys(trials) if trial not in self._known]
        with ExitStack() as stack:
            tasks = (_Task(self._settings, trial) for trial in new)
            made = spread(closed_fill, tasks, self._workers, stack)
            for trial in trials:
                if trial not in self._known:
                    self._known[trial] = next(made)
                    self._keep(trial)
                    self._look()
                yield self._known[trial]

    def _keep(self, trial: Trial) -> None:
        if self._file is not None:
            self._write({
                'weights': dict(trial.weights), 'part': trial.part, 'number': trial.number,
                'fill': self._known[trial],
            })  # fmt: skip

    def _write(self, line: dict[str, Any]) -> None:
        assert self._file is not None
        self._file.write(json.dumps(line) + '\n')
        self._file.flush()

    def _read(self, path: Path) -> None:
        if not path.exists() or not path.stat().st_size:
            return
        text = path.read_text(encoding='utf-8')
        first, *lines = text.splitlines()
        if first != json.dumps({'tuning': self._settings.identity}):
            msg = (
                f'{path} holds trials of a tuning with other options: give those again to go on '
                'with it, name another --out, or remove the file'
            )
            raise ValueError(msg)
        for line in lines:
            try:
                self._note(json.loads(line))
            except (ValueError, KeyError, TypeError, AttributeError):
                continue
        if not text.endswith('\n'):
            # the last line of a run that was killed may be half there
            with path.open('a', encoding='utf-8') as file:
                file.write('\n')

    def _note(self, line: dict[str, Any]) -> None:
        trial = Trial(tuple(line['weights'].items()), line['part'], line['number'])
        self._known[trial] = float(line['fill'])
