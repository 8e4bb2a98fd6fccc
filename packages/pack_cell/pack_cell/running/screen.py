"""Prints what people read while a run goes on; what becomes of the terminal never ends the run."""

from __future__ import annotations

import io
import os
import sys

from rich.console import Console
from rich.text import Text


class Screen(Console):
    """A console that prints every text as it is, and is silent once nobody can read any more.

    Markup and emoji codes mean nothing here: ``box[1]`` and ``lot:key:12`` are names of boxes.
    What the terminal's encoding lacks is printed as an escape. Where the other end of a pipe has
    gone, or a disk is full, the rest is not printed.
    """

    def __init__(self) -> None:
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors='backslashreplace')
        super().__init__(highlight=False, soft_wrap=True, markup=False, emoji=False)

    def tell(self, text: str | Text = '', style: str = '') -> None:
        """Print one line."""
        try:
            self.print(text, style=style or None)
        except OSError:
            self.on_broken_pipe()

    def problem(self, text: str) -> None:
        """Print one line where errors go."""
        try:
            print(text, file=sys.stderr, flush=True)
        except OSError:
            _send_nowhere(sys.stderr.fileno())

    def on_broken_pipe(self) -> None:
        """Be silent from now on, instead of ending the program."""
        self.quiet = True
        _send_nowhere(sys.stdout.fileno())


def _send_nowhere(descriptor: int) -> None:
    """Let what waits in a buffer vanish, which Python would write at its end, and all after it."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, descriptor)
    os.close(nowhere)
