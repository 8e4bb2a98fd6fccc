"""Records as one self-contained HTML page."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from pack_cell.bench import figure, report
from pack_cell.bench.values import JsonObject

_STYLE = """
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, sans-serif; color: #1f2933; background: #fff;
       max-width: 1180px; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.6rem; margin-bottom: .2rem; }
h2 { font-size: 1.15rem; margin-top: 2.2rem; }
p, li { max-width: 75ch; }
code { background: #f1f4f7; padding: .15rem .35rem; border-radius: 4px; overflow-wrap: anywhere; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .87rem; }
th, td { padding: .3rem .6rem; border-bottom: 1px solid #dde3e9; text-align: right;
         white-space: nowrap; }
th { background: #f1f4f7; white-space: normal; vertical-align: bottom; }
td.text, th.text { text-align: left; }
tr.first td { border-top: 2px solid #b8c4ce; }
td.below { color: #a3262c; font-weight: 600; }
figure { margin: 1rem 0; }
figure svg { max-width: 100%; height: auto; }
.note { color: #52606d; font-size: .9rem; }
"""

_INTRODUCTION = (
    'Fill rates are means over collections with a 95 % confidence interval; three kinds, always '
    'together: of the bins that were closed (as in the paper), of all bins used, and of the first '
    'bin when for the first time nothing fitted.'
)

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
        f'<figure>{figure.svg(records)}</figure>',
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
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<title>Packing benchmark</title><style>{_STYLE}</style></head>\n<body>\n'
        + '\n'.join(parts)
        + '\n</body></html>\n'
    )


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
    return f'<div class="scroll"><table><tr>{head}</tr>\n' + '\n'.join(lines) + '</table></div>'


def _unplaced(records: Sequence[JsonObject]) -> list[str]:
    """Each reason once per record, with how many boxes it left out."""
    lines = []
    for record in records:
        if record['unplaced']:
            first = record['unplaced'][0]
            lines.append(
                f'<li>{escape(record["algorithm"])}, {escape(record["bin"])}, look-ahead '
                f'{record["look_ahead"]}: {len(record["unplaced"])} boxes, for example '
                f'{escape(first["id"])}: {escape(first["reason"])}</li>'
            )
    return ['<h2>Boxes that fit no bin</h2>', '<ul>', *lines, '</ul>'] if lines else []
