"""Whether a node is there, answers and is active, for health checks of containers and the like.

``python3 -m pack_cell.ros.health /cell/planner`` ends with code 0 when it is, and with 1 and a line
when it is not.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import rclpy
from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

#: How long the node may take to be found, and to answer, seconds.
PATIENCE_S = 4.0


def unhealthy(node: Node, name: str, patience_s: float = PATIENCE_S) -> str:
    """Why the managed node called ``name`` is not well, in words; empty when it is.

    ``node`` asks; nobody else may spin it.
    """
    client = node.create_client(GetState, f'{name.rstrip("/")}/get_state')
    if not client.wait_for_service(patience_s):
        return f'{name} is not there'
    future = client.call_async(GetState.Request())
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    executor.spin_until_future_complete(future, timeout_sec=patience_s)
    executor.shutdown()
    if not future.done():
        return f'{name} does not answer'
    state = future.result().current_state
    return '' if state.id == State.PRIMARY_STATE_ACTIVE else f'{name} is {state.label}'


def main(names: Sequence[str] | None = None) -> int:
    """Ask about every node that is named; 1 when one of them is not well."""
    asked = sys.argv[1:] if names is None else names
    if not asked:
        print('give the full names of nodes, such as /cell/planner')
        return 2
    rclpy.init(args=[])
    node = Node('health')
    found = [text for text in (unhealthy(node, name) for name in asked) if text]
    node.destroy_node()
    rclpy.try_shutdown()
    for text in found:
        print(text)
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())
