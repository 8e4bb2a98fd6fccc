"""Records as text tables: one line each, and Table I of the paper with ours beside it."""

from __future__ import annotations

from collections.abc import Sequence

from pack_cell.bench.paper import NAMES
from pack_cell.bench.values import JsonObject

HEADINGS = (
    'bin', 'look-ahead', 'algorithm', 'closed fill %', 'all bins %', 'to first failure %',
    'paper fill %', 'median ms', '99 % ms', 'paper ms', 'placed', 'unplaced', 'status',
)  # fmt: skip

MISSING = '-'


def percent(value: float | None) -> str:
    """A fill rate in percent."""
    return MISSING if value is None else f'{value:.2f}'


def milliseconds(value: float | None) -> str:
    """Seconds as milliseconds with three significant digits."""
    if value is None:
        return MISSING
    return f'{1e3 * value:.0f}' if value >= 1.0 else f'{1e3 * value:.3g}'


def with_ci(record: JsonObject) -> str:
    """Fill of closed bins with its 95 % confidence interval."""
    half = record['fill_closed_ci95']
    return percent(record['fill_closed']) + ('' if half is None else f' ± {half:.2f}')


def name(record: JsonObject) -> str:
    """The algorithm, with its backend where that is not our own search, and CEP where it is on."""
    parts = [str(record['algorithm'])]
    if record['backend'] not in (None, 'search'):
        parts.append(str(record['backend']))
    if record['settings']['cep']:
        parts.append('CEP')
    return ', '.join(parts)


def title(record: JsonObject) -> str:
    """The same with the paper's name of the algorithm, where it has one."""
    algorithm = str(record['algorithm'])
    return NAMES.get(algorithm, algorithm) + name(record).removeprefix(algorithm)


def row(record: JsonObject) -> tuple[str, ...]:
    """The cells of a record under :data:`HEADINGS`."""
    paper = record['paper'] or {'fill': None, 'seconds': None}
    time = record['decision_s']
    statuses = ', '.join(f'{count} {name}' for name, count in record['statuses'].items())
    return (
        record['bin'],
        str(record['look_ahead']),
        name(record),
        with_ci(record),
        percent(record['fill_all']),
        percent(record['fill_first_failure']),
        percent(paper['fill']),
        milliseconds(time['p50']),
        milliseconds(time['p99']),
        milliseconds(paper['seconds']),
        str(record['placed']),
        str(len(record['unplaced'])),
        statuses or MISSING,
    )


def markdown(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [headings, ['---'] * len(headings), *rows]
    return '\n'.join('| ' + ' | '.join(line) + ' |' for line in lines)


def table1(records: Sequence[JsonObject]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows of Table I: per algorithm our fill, and the paper's in brackets.

    Only algorithms, bins and look-aheads that ``records`` has. An exclamation mark: ours is below
    the paper's by more than its own confidence interval.
    """
    by_key = {(record['look_ahead'], record['bin'], name(record)): record for record in records}
    known = [record for record in records if record['algorithm'] in NAMES]
    known.sort(key=lambda record: list(NAMES).index(record['algorithm']))
    columns = {name(record): title(record) for record in known}
    bins = list(dict.fromkeys(record['bin'] for record in records))
    rows = []
    for look_ahead in sorted({record['look_ahead'] for record in records}):
        for bin_name in bins:
            in_row = [by_key.get((look_ahead, bin_name, column)) for column in columns]
            if any(in_row):
                cells = (MISSING if record is None else _beside_paper(record) for record in in_row)
                rows.append((str(look_ahead), bin_name, *cells))
    headings = ('look-ahead', 'bin', *(f'{column} % [paper]' for column in columns.values()))
    return headings, rows


def below_paper(record: JsonObject) -> bool:
    """Whether our fill is below the paper's mean by more than our confidence interval."""
    ours, paper = record['fill_closed'], record['paper']
    if paper is None or ours is None:
        return False
    return bool(ours + (record['fill_closed_ci95'] or 0.0) < paper['fill'])


def _beside_paper(record: JsonObject) -> str:
    paper = record['paper']
    mark = ' !' if below_paper(record) else ''
    return f'{percent(record["fill_closed"])} [{percent(paper["fill"] if paper else None)}]{mark}'


def sources(records: Sequence[JsonObject]) -> list[str]:
    """A sentence for each kind of bin about its boxes, for the reader of a table."""
    sentences = {}
    for record in records:
        settings = record['settings']
        boxes = record['boxes_source']
        count = settings['destinations']
        pool = f' for {count} destinations' if count else ''
        if settings['boxes_per_bin']:
            boxes += f', {settings["boxes_per_bin"]} boxes per bin'
        sentences[record['bin'], boxes] = (
            f'{record["bin"]}: {record["collections"]} collections of {boxes}; orientations '
            f'{settings["orientations"]!r}, {settings["open_bins"]} open bins{pool}, seed '
            f'{settings["seed"]}; {settings["clock"]} time.'
        )
    return list(sentences.values())


def paper_note(records: Sequence[JsonObject]) -> str:
    """What to keep in mind when ours and the paper's figures stand side by side."""
    drawn = sorted({record['bin'] for record in records if not record['settings']['boxes_per_bin']})
    note = (
        'Paper: Ojha et al., arXiv:2111.01072, Table I, seconds on an i7-6820HQ. "!" marks a fill '
        "below the paper's by more than our 95 % confidence interval."
    )
    if drawn:
        note += (
            f" The boxes of {', '.join(drawn)} are not the paper's, whose client's data are "
            'private; there the two columns show different boxes.'
        )
    return note
