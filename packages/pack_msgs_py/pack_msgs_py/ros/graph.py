"""Which nodes there are."""

from __future__ import annotations

from collections.abc import Callable, Collection

from rclpy.node import Node


def node_names(node: Node) -> Callable[[], Collection[str]]:
    """Asks for the full names of all nodes that ``node`` knows of."""

    def names() -> Collection[str]:
        found = node.get_node_names_and_namespaces()
        return {f'{namespace.rstrip("/")}/{name}' for name, namespace in found}

    return names
