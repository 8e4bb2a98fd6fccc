"""Table I of Ojha et al. (arXiv:2111.01072), to stand beside our figures."""

from __future__ import annotations

import csv
from functools import lru_cache
from pathlib import Path

from pack_cell.bench.values import BenchSettings, Case, JsonObject

TABLE = Path(__file__).parent / 'data' / 'paper_table1.csv'

#: Our names of the algorithms and the paper's, in the order of its table.
NAMES = {
    'first_fit': 'FF',
    'o_first_fit': 'O-FF',
    'best_fit': 'BF',
    'o_best_fit': 'O-BF',
    'o_jampack': 'O-JP',
    'mpack_lite': 'MPackLite',
    'mpack': 'MPack',
}

#: Who packs there with the constraints for efficient packing (CEP).
WITH_CONTACT = ('mpack',)

BINS = ('LDC', 'RC', 'PAL', 'EQ', 'SYN')
LOOK_AHEADS = (1, 2, 3, 4, 5)
OPEN_BINS = 3

#: "All 6 rotations are allowed" (section IV), where the lab rule (section II-B) allows four.
ORIENTATIONS = 'any'


def collections_of(bin_name: str) -> int:
    """How many collections the paper packed: 30 for SYN, 25 for an industrial bin."""
    return 30 if bin_name == 'SYN' else 25


@lru_cache(maxsize=1)
def table() -> dict[tuple[str, str, int], tuple[float, float]]:
    """Fill rate in percent and seconds per box by (algorithm, bin, look-ahead), the paper's names.

    What the paper marks as not available is not there.
    """
    with TABLE.open(encoding='utf-8', newline='') as file:
        rows = csv.DictReader(line for line in file if not line.startswith('#'))
        return {
            (row['algorithm'], row['bin'], int(row['look_ahead'])): (
                float(row['fill_rate_percent']),
                float(row['seconds_per_box']),
            )
            for row in rows
            if row['fill_rate_percent']
        }


def paper_figures(case: Case, settings: BenchSettings) -> JsonObject | None:
    """The paper's figures for a case, ``None`` where it has none or the rules are others.

    First fit and best fit on SYN have none of their own, but with one box in the look-ahead
    they are O-FF and O-BF.
    """
    if settings.profile.name != 'paper' or case.algorithm not in NAMES or settings.destinations > 1:
        return None
    name = NAMES[case.algorithm]
    of_paper = table().get((name, case.bin_spec.name, case.look_ahead))
    if of_paper is None and case.look_ahead == 1:
        of_paper = table().get((f'O-{name}', case.bin_spec.name, 1))
    return None if of_paper is None else {'fill': of_paper[0], 'seconds': of_paper[1]}
