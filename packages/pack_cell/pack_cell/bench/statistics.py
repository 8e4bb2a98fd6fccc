"""From packed collections to one record."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict

from pack_cell.bench.paper import paper_figures
from pack_cell.bench.values import BenchSettings, Case, JsonObject, Packed
from pack_msgs_py.metrics import time_summary
from pack_msgs_py.profiles import find_profile
from pack_planner.algorithms import find_algorithm

#: Keys of a record that say what it is about; the others say what came of it.
IDENTITY = (
    'algorithm', 'backend', 'bin', 'look_ahead', 'profile', 'boxes_source', 'collections',
    'settings',
)  # fmt: skip


def t975(degrees: int) -> float:
    """97.5 % quantile of Student's t distribution."""
    # Here, because it takes a second to load.
    from scipy import stats

    return float(stats.t.ppf(0.975, degrees))


def ci95(values: Sequence[float]) -> float | None:
    """Half width of the 95 % confidence interval of the mean; ``None`` below two values."""
    if len(values) < 2:
        return None
    mean = sum(values) / len(values)
    variance = sum((value - mean) ** 2 for value in values) / (len(values) - 1)
    return t975(len(values) - 1) * math.sqrt(variance / len(values))


def record(case: Case, settings: BenchSettings, packed: Sequence[Packed]) -> JsonObject:
    """The record of a case. Fills are means over collections, in percent."""
    places = [
        event for collection in packed for event in collection.events if event['event'] == 'place'
    ]
    seconds = [event['seconds'] for collection in packed for event in collection.events]
    fills = {name: _known(packed, name) for name in packed[0].fills}
    # where nothing is proven there is no gap to average; JSON has no infinity either
    gaps = [gap for collection in packed for gap in collection.gaps if math.isfinite(gap)]
    return {
        **identity(case, settings),
        'boxes': sum(collection.boxes for collection in packed),
        'placed': len(places),
        'unplaced': [dict(entry) for collection in packed for entry in collection.unplaced],
        'closed_bins': sum(collection.closed_bins for collection in packed),
        **{name: _mean(values) for name, values in fills.items()},
        'fill_closed_ci95': ci95(fills['fill_closed']),
        'decision_s': time_summary(seconds),
        'statuses': dict(sorted(Counter(event['status'] for event in places).items())),
        'gap': {'mean': _mean(gaps), 'max': max(gaps, default=None)},
        'paper': paper_figures(case, settings),
    }


def identity(case: Case, settings: BenchSettings) -> JsonObject:
    """What a record is about: equal for the same question, whoever asks it."""
    source, profile = case.source, settings.profile
    algorithm = find_algorithm(case.algorithm, case.digest)
    own_file = {'algorithm_digest': case.digest} if case.digest else {}
    usual = find_profile(profile.name)
    margins = {
        name: getattr(profile, name)
        for name in ('clearance_mm', 'resolution_mm')
        if getattr(profile, name) != getattr(usual, name)
    }
    return {
        'algorithm': algorithm.name,
        'backend': case.backend if algorithm.backends else None,
        'bin': case.bin_spec.name,
        'look_ahead': case.look_ahead,
        'profile': profile.name,
        'boxes_source': source.name,
        'collections': case.collections,
        'settings': {
            'bin_size_mm': list(case.bin_spec.size_mm),
            'orientations': profile.orientations,
            'open_bins': settings.open_bins,
            'destinations': settings.destinations,
            'weights': list(asdict(settings.weights.of(case.bin_spec)).values()),
            **asdict(settings.options),
            'cep': case.cep,
            'budget_s': settings.budget_s,
            'node_limit': settings.node_limit,
            'clock': 'cpu' if settings.cpu_clock else 'wall',
            'seed': settings.seed,
            'boxes_per_bin': None if source.boxes else settings.boxes_per_bin,
            'shuffle': source.shuffle,
            'boxes_digest': source.digest,
            **own_file,
            **margins,
            **_where_used(case, settings),
        },
    }


def _where_used(case: Case, settings: BenchSettings) -> JsonObject:
    """What records have only since it can be chosen, so that older ones are found as well."""
    used: JsonObject = {}
    if settings.scan_sigma_mm:
        used['scan_sigma_mm'] = settings.scan_sigma_mm
    if settings.tuned is not None and settings.tuned.has(find_algorithm(case.algorithm).name):
        used['tuned_digest'] = settings.tuned.digest
    return used


def _known(packed: Sequence[Packed], name: str) -> list[float]:
    return [value for collection in packed if (value := collection.fills[name]) is not None]


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None
