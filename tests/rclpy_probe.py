"""Wait until a node is on the graph."""

from __future__ import annotations

import time

import rclpy


def wait_for_node(name: str, domain: int, seconds: float = 20.0) -> None:
    """Return when a node called ``name`` is seen; fail after ``seconds``."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    node = rclpy.create_node('probe', context=context)
    end = time.monotonic() + seconds
    try:
        while name not in node.get_node_names():
            if time.monotonic() > end:
                raise AssertionError(f'node {name} did not appear in {seconds} s')
            rclpy.spin_once(node, timeout_sec=0.05, executor=_executor(context))
    finally:
        node.destroy_node()
        rclpy.try_shutdown(context=context)


def _executor(context: rclpy.Context):  # type: ignore[no-untyped-def]
    from rclpy.executors import SingleThreadedExecutor

    return SingleThreadedExecutor(context=context)
