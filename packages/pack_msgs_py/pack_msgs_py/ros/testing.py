"""For tests of nodes: a context of one's own, and nodes that are spun in a thread."""

from __future__ import annotations

import contextlib
import gc
import threading
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import TypeVar

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

#: How long a spinning thread may take to end.
CLOSING_S = 10.0

SomeNode = TypeVar('SomeNode', bound=Node)


@contextlib.contextmanager
def private_context(domain: int | None = None) -> Iterator[rclpy.Context]:
    """A ROS context in ``domain`` (that of the environment by default), shut down at the end.

    Nodes lie in reference cycles, and one that is freed late takes along the ``/rosout`` publisher
    of a new node of the same name: nothing that is logged is published any more. So nodes that an
    earlier test has done with are freed first.
    """
    gc.collect()
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    try:
        yield context
    finally:
        rclpy.try_shutdown(context=context)


def _nothing() -> None:
    """A task that wakes an executor."""


class Spinner:
    """Spins nodes in one thread until it is closed; then it destroys them.

    Parameters
    ----------
    context
        Of the nodes; a private one by default, which is shut down with the spinner.
    domain
        ROS domain of the private context, that of the environment by default.
    """

    def __init__(self, context: rclpy.Context | None = None, *, domain: int | None = None) -> None:
        self._at_the_end = contextlib.ExitStack()
        if context is None:
            context = self._at_the_end.enter_context(private_context(domain))
        self.context = context
        self.executor = SingleThreadedExecutor(context=context)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._closing = False

    def add(self, node: SomeNode, before_destroy: Callable[[], object] | None = None) -> SomeNode:
        """Spin ``node`` too; ``before_destroy`` is called once nothing spins it any more."""
        self._at_the_end.callback(node.destroy_node)
        if before_destroy is not None:
            self._at_the_end.callback(before_destroy)
        self.executor.add_node(node)
        if not self._thread.is_alive():
            self._thread.start()
        return node

    def close(self) -> None:
        """End the thread, destroy the nodes, and shut a private context down."""
        self._closing = True
        if self._thread.is_alive():
            # An executor that is shut down while it spins may fail on what is already gone.
            self.executor.create_task(_nothing)
            self._thread.join(CLOSING_S)
        self.executor.shutdown()
        self._at_the_end.close()

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            while not self._closing:
                self.executor.spin_once()

    def __enter__(self) -> Spinner:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
