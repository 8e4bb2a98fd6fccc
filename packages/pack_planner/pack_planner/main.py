"""Starts the node; a signal ends it with code 0 even while Python still imports its modules."""

from __future__ import annotations

import sys
from importlib.util import find_spec

from pack_msgs_py.signals import signals_end_quietly


def main() -> None:
    """Import the node, which takes about a second, and run it."""
    with signals_end_quietly():
        try:
            from pack_planner.ros import node
        except ModuleNotFoundError:
            if find_spec('rclpy') is not None:
                raise
            sys.exit('planner: the node needs ROS 2; `from pack_planner import pack` does not')
    node.main()
