"""The options as tables for ``docs/options.md``."""

from __future__ import annotations

from itertools import groupby

from pack_cell.options.declaration import NamedOption, declared_options
from pack_cell.options.run_options import RunOptions

_HEAD = (
    '| option | values | default | what it does | parameters of the nodes |\n|---|---|---|---|---|'
)


def option_tables() -> str:
    """A heading and a table for each group of options, in Markdown."""
    groups = groupby(declared_options(RunOptions), lambda named: named.declaration.group)
    return '\n'.join(
        f'### {group[0].upper()}{group[1:]}\n{_HEAD}\n' + ''.join(map(_row, members))
        for group, members in groups
    )


def _row(named: NamedOption) -> str:
    declaration = named.declaration
    values = declaration.values_text or (f'`{declaration.metavar}`' if declaration.metavar else '')
    default = declaration.says_default
    if declaration.launch_default:
        default += f'; of the launch file `{declaration.launch_default}`'
    text = declaration.text
    if declaration.see:
        text += f'; [more]({declaration.see})'
    parameters = ', '.join(f'`{parameter}`' for parameter in declaration.parameters)
    if not declaration.launched:
        parameters = parameters or '`cell run` alone'
    cells = (f'`{named.flag}`', values, default, text, parameters)
    return '| ' + ' | '.join(cell.replace('|', '\\|') for cell in cells) + ' |\n'
