"""The options of a run as text and back, so that the run can be gone on with later."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pack_cell.options.declaration import NamedOption, declared_options
from pack_cell.options.run_options import RunOptions
from pack_msgs_py.values import BinSpec

#: Options that name files: their texts stay as they are, since the files may be gone.
FILE_OPTIONS = ('boxes', 'arrivals', 'layout', 'tuned', 'start_bins')


def kept_options() -> list[NamedOption]:
    """The options that belong to a run, whoever goes on with it: all but where it is kept."""
    return [named for named in declared_options(RunOptions) if named.key not in ('out', 'resume')]


def texts_of(options: RunOptions) -> dict[str, Any]:
    """Each option by its argument: a text, a flag, or a list of texts."""
    return {named.argument: _text(getattr(options, named.key)) for named in kept_options()}


def options_from(texts: Mapping[str, Any]) -> RunOptions:
    """Inverse of :func:`texts_of`; an option that is not among ``texts`` has its default.

    Raises
    ------
    ValueError
        There is an option that is not known here, or a text is no value of its option.
    """
    known = {named.argument: named for named in kept_options()}
    unknown = sorted(set(texts) - set(known))
    if unknown:
        msg = f'options {", ".join(unknown)} are not known here: another version began the run'
        raise ValueError(msg)
    values = {known[name].key: _value(known[name], text) for name, text in texts.items()}
    return RunOptions(**values)


def conflicts(kept: RunOptions, given: Mapping[str, Any]) -> list[str]:
    """Options among ``given``, by key, that are not as those of the run; a clause each."""
    return [
        f'{named.flag} is {_text(getattr(kept, named.key)) or "not given"} there '
        f'and {_text(given[named.key])} here'
        for named in kept_options()
        if named.key in given
        and not named.declaration.resumable
        and _text(given[named.key]) != _text(getattr(kept, named.key))
    ]


def _text(value: Any) -> Any:  # noqa: ANN401 - whatever an option holds
    if isinstance(value, bool):
        return value
    if isinstance(value, (tuple, list)):
        return [f'{name}={_written(part)}' for name, part in value]
    if isinstance(value, BinSpec):
        return value.name
    return '' if value is None else str(value)


def _written(value: Any) -> str:  # noqa: ANN401 - a value of a parameter
    return str(value).lower() if isinstance(value, bool) else str(value)


def _value(named: NamedOption, text: Any) -> Any:  # noqa: ANN401 - as JSON has it, and as the option
    if named.declaration.flag:
        return bool(text)
    if named.declaration.repeated:
        return tuple(named.read(str(part)) for part in text)
    if text == '':
        return named.declaration.default_value()
    if named.key not in FILE_OPTIONS:
        return named.read(str(text))
    if named.key in ('boxes', 'arrivals'):
        return str(text)
    return Path(text)
