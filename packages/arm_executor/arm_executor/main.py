"""Starts the node; a signal ends it with code 0 even while Python still imports its modules."""

from __future__ import annotations

from pack_msgs_py.signals import signals_end_quietly


def main() -> None:
    """Import the node, which takes about a second, and run it."""
    with signals_end_quietly():
        from arm_executor.ros import node
    node.main()
