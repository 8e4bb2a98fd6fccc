"""``cell completion``: what a shell completes, made from the parser by shtab."""

from __future__ import annotations

import argparse
from typing import Any

import shtab

#: Verbs of the ``cell`` script that the Python command line does not know.
SCRIPT_VERBS = {
    'setup': 'set up only',
    'test': 'lint, type check and tests',
    'shell': 'a shell that knows the cell',
    'python': 'Python in the environment of the cell',
    'ros2': 'the ros2 command line',
    'echo': 'print a topic of the running cell',
    'clean': 'remove .cell/',
    'help': 'list the verbs',
}


def add_script_verbs(verbs: Any) -> None:  # noqa: ANN401 - argparse does not name its subparsers
    """Add the verbs of the script, so that they are completed too."""
    for name, text in SCRIPT_VERBS.items():
        verbs.add_parser(name, help=text, add_help=False)


def completion_script(parser: argparse.ArgumentParser, shell: str) -> str:
    """The completion of ``parser`` for ``shell``, bash or zsh."""
    return str(shtab.complete(parser, shell=shell))
