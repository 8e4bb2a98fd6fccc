"""Options as data: one frozen dataclass per command, a declaration with each field.

An option is declared once, with its reader, default and text; from that follow the command line,
the arguments of the launch file, the parameters of the nodes, and the table in docs/options.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from pack_cell.options.parsers import BadValue, NumberRange, OneOf

#: Profile of who names none.
DEFAULT_PROFILE = 'cell'


@dataclass(frozen=True)
class Declaration:
    """What there is to say of an option.

    Attributes
    ----------
    default : as one would write it; empty for none.
    text : what the option does, in Markdown.
    group : heading under which it is listed.
    name : on the command line, where it is not the key of the field.
    read : turns text into the value, or raises ``ValueError``; a flag reads nothing.
    metavar : what stands for the value in the help; not for a flag or :class:`OneOf`.
    values : what can be written, in Markdown, where ``read`` does not say it.
    default_text : what happens without the option, where ``default`` does not say it.
    by_profile : default by the name of the profile.
    see : page in ``docs/`` that tells more.
    flag : switched on by its name alone.
    repeated : may be given more than once; the value is a tuple.
    launched : whether the launch file has it as an argument too; not what is about a whole run.
    launch_default : default of the launch file, where that is meant to differ.
    parameters : parameters of nodes that it becomes, as ``node.parameter``.
    as_parameter : turns the value into that of the parameters.
    in_summary : whether ``summary.json`` repeats the value, by the key of the field.
    resumable : whether it may be another one when a run is gone on with.
    """

    default: str
    text: str
    group: str
    name: str = ''
    read: Callable[[str], Any] = str
    metavar: str = ''
    values: str = ''
    default_text: str = ''
    by_profile: Mapping[str, float | str] | None = None
    see: str = ''
    flag: bool = False
    repeated: bool = False
    launched: bool = True
    launch_default: str = ''
    parameters: tuple[str, ...] = ()
    as_parameter: Callable[[Any], Any] | None = None
    in_summary: bool = False
    resumable: bool = False

    def default_value(self) -> Any:  # noqa: ANN401 - whatever the option reads
        """The value without the option, and without a profile."""
        if self.by_profile is not None:
            return self.by_profile[DEFAULT_PROFILE]
        if self.flag or self.repeated:
            return False if self.flag else ()
        return self.default if isinstance(self.read, OneOf) else self.read(self.default)

    @property
    def values_text(self) -> str:
        """What can be written, in Markdown; empty where anything can."""
        if self.values:
            return self.values
        if isinstance(self.read, OneOf):
            meanings = self.read.meanings
            words = ((word, meanings.get(word, '')) for word in self.read.words)
            return ', '.join(f'`{word}`{f" ({told})" if told else ""}' for word, told in words)
        return str(self.read) if isinstance(self.read, NumberRange) else ''

    @property
    def says_default(self) -> str:
        """The default, in Markdown."""
        if self.by_profile is not None:
            return ', '.join(
                f'{f"`{value}`" if isinstance(value, str) else f"{value:g}"} with `{name}`'
                for name, value in self.by_profile.items()
            )
        if self.flag:
            return 'off'
        return self.default_text or (f'`{self.default}`' if self.default else 'none')


@dataclass(frozen=True)
class NamedOption:
    """An option with its names: ``key`` of the field, ``flag`` and ``argument`` (launch)."""

    key: str
    declaration: Declaration

    @property
    def flag(self) -> str:
        """As on the command line."""
        return f'--{self.argument.replace("_", "-")}'

    @property
    def argument(self) -> str:
        """As in a launch file."""
        return self.declaration.name or self.key

    def read(self, text: str) -> Any:  # noqa: ANN401 - whatever the option reads
        """The value that ``text`` stands for; :class:`BadValue` when it stands for none."""
        try:
            return self.declaration.read(text)
        except BadValue:
            raise
        except (ValueError, OSError) as error:
            raise BadValue(str(error)) from None


def option(default: str, text: str, group: str, **more: Any) -> Any:  # noqa: ANN401
    """A dataclass field that is an option; ``more`` are attributes of :class:`Declaration`."""
    declaration = Declaration(default, text, group, **more)
    return field(default_factory=declaration.default_value, metadata={'option': declaration})


def declared_options(command: type) -> Iterator[NamedOption]:
    """The options that ``command``, a dataclass, declares."""
    for declared in fields(command):
        yield NamedOption(declared.name, declared.metadata['option'])


def help_text(declaration: Declaration, default: str = '', *, words: bool = True) -> str:
    """What the option does, what can be written, and the ``default``, as plain text.

    Without ``words``, those that an option chooses from are left out where they mean nothing more.
    """
    text, values = declaration.text, declaration.values_text
    notes = [f'default {default}'] if default else []
    if isinstance(declaration.read, NumberRange):
        notes.insert(0, values)
    elif values and (words or not isinstance(declaration.read, OneOf) or declaration.read.meanings):
        text += f': {values}'
    return (f'{text} ({", ".join(notes)})' if notes else text).replace('`', '')


def add_options(
    parser: argparse.ArgumentParser, command: type, only: Collection[str] | None = None
) -> None:
    """Add every option of ``command`` to ``parser``, or ``only`` those with these keys.

    The namespace holds those that are given.
    """
    groups: dict[str, argparse._ArgumentGroup] = {}
    for named in declared_options(command):
        if only is not None and named.key not in only:
            continue
        heading = named.declaration.group
        if heading not in groups:
            groups[heading] = parser.add_argument_group(heading)
        add_option(groups[heading], named)


def add_option(parser: argparse._ActionsContainer, named: NamedOption) -> None:
    """Add one option to ``parser`` or a group of it; the namespace holds it when it is given."""
    declaration = named.declaration
    more: dict[str, Any] = {'action': 'store_true'}
    if not declaration.flag:
        metavar = declaration.metavar
        if isinstance(declaration.read, OneOf):
            metavar = f'{{{",".join(declaration.read.words)}}}'
        action = 'append' if declaration.repeated else 'store'
        more = {'action': action, 'type': named.read, 'metavar': metavar}
    default = '' if declaration.flag or declaration.repeated else declaration.says_default
    text = help_text(declaration, default, words=False).replace('%', '%%')
    parser.add_argument(named.flag, dest=named.key, default=argparse.SUPPRESS, help=text, **more)
