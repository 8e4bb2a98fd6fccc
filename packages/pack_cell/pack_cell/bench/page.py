"""Records as one self-contained HTML page."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from markupsafe import Markup

from pack_cell.bench import figure, report
from pack_cell.bench.values import JsonObject
from pack_cell.pages.rendering import render
from pack_msgs_py.wording import how_many

_INTRODUCTION = (
    'Fill rates are means over collections with a 95 % confidence interval; three kinds, always '
    'together: of the bins that were closed (as in the paper), of all bins used, and of the first '
    'bin when for the first time nothing fitted.'
)

#: Rows of a table that is printed on one page.
_SHORT = 20
_TEXT_COLUMNS = ('bin', 'algorithm', 'status')


def page(records: Sequence[JsonObject], command: str) -> str:
    """The page: figure, our figures beside the paper's, every record, what could not be placed."""
    sources = ''.join(f'<li>{escape(sentence)}</li>' for sentence in report.sources(records))
    parts = [
        '<h1>Packing benchmark</h1>',
        f'<p class="note">Made by <code>{escape(command)}</code></p>',
        f'<p>{_INTRODUCTION}</p>',
        f'<ul>{sources}</ul>',
        '<h2>Fill and time against look-ahead</h2>',
        f'<figure class="plot">{figure.svg(records)}</figure>',
    ]
    if any(record['paper'] for record in records):
        parts += [
            '<h2>Beside Table I of the paper</h2>',
            f'<p class="note">{escape(report.paper_note(records))}</p>',
            _table(*report.table1(records)),
        ]
    parts += [
        '<h2>All records</h2>',
        _table(report.HEADINGS, [report.row(record) for record in records]),
        *_unplaced(records),
    ]
    # Every value in it is escaped above, the figure is our own.
    return render('pages/base.html', title='Packing benchmark', body=Markup('\n'.join(parts)))


def _table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    text = [heading in _TEXT_COLUMNS for heading in headings]
    head = ''.join(
        f'<th{" class=text" if left else ""}>{escape(heading)}</th>'
        for heading, left in zip(headings, text, strict=True)
    )
    lines, before = [], None
    for row in rows:
        group = row[0]
        cells = ''.join(
            f'<td class="{"text" if left else ""}{" below" if cell.endswith("!") else ""}">'
            f'{escape(cell)}</td>'
            for cell, left in zip(row, text, strict=True)
        )
        lines.append(f'<tr{" class=first" if group != before else ""}>{cells}</tr>')
        before = group
    # One that fits on a sheet of paper is not divided between two.
    whole = ' class="short"' if len(lines) <= _SHORT else ''
    top, body = f'<thead><tr>{head}</tr></thead>', '\n'.join(lines)
    return f'<div class="scroll"><table{whole}>{top}\n<tbody>{body}</tbody></table></div>'


def _unplaced(records: Sequence[JsonObject]) -> list[str]:
    """Each reason once per record, with how many boxes it left out."""
    lines = []
    for record in records:
        if record['unplaced']:
            first = record['unplaced'][0]
            lines.append(
                f'<li>{escape(record["algorithm"])}, {escape(record["bin"])}, look-ahead '
                f'{record["look_ahead"]}: {how_many(len(record["unplaced"]), "box")}, for example '
                f'{escape(first["id"])}: {escape(first["reason"])}</li>'
            )
    return ['<h2>Boxes that fit no bin</h2>', '<ul>', *lines, '</ul>'] if lines else []
