"""``python -m pack_cell`` and the command ``cell``: the same as ``./cell`` after set-up."""

from __future__ import annotations

import sys

from pack_cell.operate.options import OPERATING


def main() -> int:
    """Run one command; returns its exit code."""
    if sys.argv[1:2] and sys.argv[1] in OPERATING:
        # Who wants to stop a cell does not wait for the compiler of the planner to be loaded.
        from pack_cell.operate.command import operate

        return operate(sys.argv[1:])
    from pack_cell.cli import main as run_command

    return run_command()


if __name__ == '__main__':
    sys.exit(main())
