"""Arguments of the launch file: the options of ``cell run``, as parameters of the nodes.

Knows nothing of launch, so that it can be tested where launch is not installed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from pack_cell.options.declaration import NamedOption, declared_options, help_text
from pack_cell.options.parsers import BadValue
from pack_cell.options.run_options import RunOptions, run_options
from pack_cell.running.node_parameters import check_cell, node_parameters

#: What arguments were called before they had the names of the options.
FORMER_NAMES = {'boxes_file': 'boxes', 'bin_type': 'bin', 'deadline_s': 'deadline'}

LAUNCH_FILE = 'cell.launch.py'
#: Arguments of the launch file that are no option of a run: default, and what they say.
OWN_ARGUMENTS = {
    'namespace': ('', 'of every node'),
    'frame_prefix': (
        '',
        'before the name of every frame, such as north/: two cells in one domain keep apart',
    ),
    'state_dir': ('', 'folder of the journals; empty: state is lost with the node'),
    'params_file': ('', 'YAML file of parameters; what it says wins over the other arguments'),
    'record': ('', 'MCAP file for every topic; empty: none'),
    'view': ('false', 'show the cell on a page in the browser'),
    'rviz': ('false', 'open RViz on the cell'),
    'view_port': ('8080', 'port of that page'),
    'respawn': ('false', 'start a node again that ended; otherwise that ends the launch'),
    'exit_at_end': ('true', 'end the launch when every box of the stream is accounted for'),
    'use_sim_time': ('false', 'take the time from /clock'),
    'publish_clock': ('false', 'the arm executor tells robot time on /clock'),
    'autostart': ('true', 'otherwise belt, planner and arm wait, unconfigured, for transitions'),
    'log_level': ('info', 'debug, info, warn, error or fatal'),
}


def check_names(words: Sequence[str]) -> None:
    """Refuse ``name:=value`` among the words of a command line where there is no such argument.

    Raises
    ------
    ValueError
        Which one, and which there are.
    """
    if not any(word.endswith(LAUNCH_FILE) for word in words):
        return  # included by another launch file, whose arguments these are
    known = {*OWN_ARGUMENTS, *_options(), *FORMER_NAMES}
    for word in words:
        name, mark, _ = word.partition(':=')
        if mark and name not in known:
            near = ', '.join(get_close_matches(name, known))
            hint = f'did you mean {near}? ' if near else ''
            use = ', '.join(sorted(known - set(FORMER_NAMES)))
            msg = f'cell.launch.py: unknown argument {name}: {hint}there are {use}'
            raise ValueError(msg)


@dataclass(frozen=True)
class LaunchArgument:
    """An argument as launch declares it; with an empty text the option has its own default."""

    name: str
    default: str
    description: str


def _options() -> dict[str, NamedOption]:
    """The options that are about the nodes, by the name of the argument."""
    return {
        named.argument: named
        for named in declared_options(RunOptions)
        if named.declaration.launched
    }


def launch_arguments() -> list[LaunchArgument]:
    """The arguments of the launch file."""
    arguments = []
    for name, named in _options().items():
        declaration = named.declaration
        default = declaration.launch_default or declaration.default
        description = help_text(declaration)
        if not default:
            description += f'; empty: {declaration.says_default.replace("`", "")}'
        arguments.append(LaunchArgument(name, default, description))
    return arguments


def is_on(name: str, text: str) -> bool:
    """Whether the argument ``name``, given as ``text``, switches something on.

    Raises
    ------
    ValueError
        The text says neither.
    """
    word = text.strip().lower()
    if word in ('true', '1', 'yes', 'on'):
        return True
    if word in ('false', '0', 'no', 'off'):
        return False
    msg = f'cell.launch.py: argument {name}: {text!r} is neither true nor false'
    raise ValueError(msg)


def launched_nodes(texts: Mapping[str, str], state_dir: str = '') -> dict[str, dict[str, Any]]:
    """Parameters of each node, by its name, for the ``texts`` of arguments by their names.

    ``state_dir`` is the folder of the journals; with an empty one state is lost with the node.

    Raises
    ------
    ValueError, OSError
        An argument is unknown, its text is no value of its option, or the cell cannot be run so.
    """
    known = _options()
    given: dict[str, Any] = {}
    for name, text in texts.items():
        if name not in known:
            new = FORMER_NAMES.get(name)
            use = f'it is called {new} now' if new else f'use {", ".join(known)}'
            msg = f'cell.launch.py: unknown argument {name}: {use}'
            raise ValueError(msg)
        if text:
            try:
                given[known[name].key] = known[name].read(text)
            except BadValue as error:
                msg = f'cell.launch.py: argument {name}: {error}'
                raise ValueError(msg) from None
    options = run_options(given)
    check_cell(options)
    nodes = node_parameters(Path(), options)
    for parameters in nodes.values():
        if 'state_dir' in parameters:
            parameters['state_dir'] = state_dir
    return nodes
