"""What people and programs are told of a tuning."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pack_cell.tune.checking import Gain
from pack_cell.tune.search import Generation, SearchOutcome
from pack_cell.tune.values import TuneSettings, Weighting


def generation_line(generation: Generation, seconds: float) -> str:
    """A generation in one line, ``seconds`` after this run began."""
    return (
        f'{seconds / 60:.1f} min, generation {generation.number}, {generation.evaluations} '
        f'candidates: start fills {generation.start_fill:.1f} %, candidates '
        f'{generation.mean_gain:+.1f} on average, {generation.best_gain:+.1f} at best; '
        f'step {generation.step:.3f}'
    )


def record(
    settings: TuneSettings, found: SearchOutcome, gain: Gain, command: str
) -> dict[str, Any]:
    """How weights were found and what they gain, as JSON; kept with them in the parameter file."""
    generations = found.generations
    return {
        'command': command,
        'boxes': [_short(choice) for choice in settings.boxes],
        'look_ahead': settings.look_ahead,
        'open_bins': settings.open_bins,
        'scan_sigma_mm': settings.scan_sigma_mm,
        'stream_bins': settings.stream_bins,
        'seed': settings.seed,
        'streams': settings.streams,
        'generations': len(generations),
        'candidates': generations[-1].evaluations if generations else 0,
        'check': {
            'streams': len(gain.before),
            'fill_before': round(gain.fill_before, 2),
            'fill_after': round(gain.fill_after, 2),
            'gain': round(gain.points, 2),
            'gain_ci95': None if gain.ci95 is None else round(gain.ci95, 2),
            'verdict': gain.verdict,
        },
    }


def summary(
    settings: TuneSettings, start: Weighting, found: SearchOutcome, gain: Gain
) -> Iterator[str]:
    """The outcome in a few lines."""
    rules = f'{settings.profile.name}, orientations {settings.profile.orientations}'
    yield f'{settings.bin_spec.name}, {rules}: {len(found.generations)} generations'
    yield ''
    yield f'{"weight":14}{"start":>10}{"found":>10}'
    after = dict(found.weights)
    for name, before in start:
        yield f'{name:14}{_written(before):>10}{_written(after[name]):>10}'
    yield ''
    half = '' if gain.ci95 is None else f' \u00b1 {gain.ci95:.1f}'
    yield (
        f'closed fill on {len(gain.before)} streams that the search has not seen: '
        f'{gain.fill_before:.1f} % before, {gain.fill_after:.1f} % after, '
        f'{gain.points:+.1f}{half} points: {gain.verdict}'
    )


def _written(value: float | bool) -> str:
    return str(value).lower() if isinstance(value, bool) else f'{value:g}'


def _short(choice: str) -> str:
    """A stream by name without the folder of its file, which is nobody else's business."""
    head, slash, tail = choice.rpartition('/')
    if not slash:
        return choice
    kinds = head.partition('/')[0]
    return f'{kinds}{Path(tail).name}'
