"""The life of a node's process: made, spun until a signal, taken down, and its exit code."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from typing import TypeVar

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node

from pack_msgs_py.ros.parameter_service import check_parameters_of_nodes
from pack_msgs_py.ros.security import NoSecurity, secured_or_nothing

SomeNode = TypeVar('SomeNode', bound=Node)

#: So long after its start a node has heard the time, if anybody tells it, seconds.
CLOCK_S = 3.0
#: Exit codes: what was asked for cannot be done, and what was begun cannot go on.
CANNOT_START, FAILED = 2, 1


def run_node(
    name: str,
    create: Callable[[], SomeNode],
    *,
    args: list[str] | None = None,
    cannot_start: tuple[type[Exception], ...] = (ValueError,),
    failed: tuple[type[Exception], ...] = (),
    stop: Callable[[SomeNode], bool] | None = None,
    spun_by: Callable[[SomeNode], Executor] = lambda node: SingleThreadedExecutor(),
) -> None:
    """Run the node that ``create`` makes until SIGINT or SIGTERM, then end the process.

    Parameters
    ----------
    name
        Under which the reason of a failure is logged.
    create
        Makes the node.
    args
        Of the command line; those of the process by default.
    cannot_start
        Errors of ``create`` that say what is wrong with what was asked for: exit code 2.
    failed
        Errors that say why the node cannot go on: exit code 1.
    stop
        Ends what the node has begun. When it returns False a thread goes on that cannot be ended:
        the process then ends without waiting for it, since Python would be taken down around it.
    spun_by
        Makes what spins the node.

    Raises
    ------
    SystemExit
        With code 0 after a signal, 2 or 1 after an expected error.
    Exception
        Any other error, as it came.
    """
    stopped, code = _life(name, create, args, cannot_start, failed, stop, spun_by)
    if not stopped:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    sys.exit(code)


def warn_without_clock(node: Node) -> None:
    """Have ``node`` say it when it is to take the time from `/clock`, and nobody tells it there."""
    if not node.get_parameter('use_sim_time').value:
        return

    def look() -> None:
        timer.cancel()
        if not node.get_clock().now().nanoseconds:
            node.get_logger().warning(
                f'use_sim_time is true, and nothing has come on /clock for {CLOCK_S:g} s: time '
                'stands still, and so does this node; publish /clock, or set use_sim_time to false'
            )

    timer = node.create_timer(CLOCK_S, look, clock=Clock(clock_type=ClockType.STEADY_TIME))


def _life(
    name: str,
    create: Callable[[], SomeNode],
    args: list[str] | None,
    cannot_start: tuple[type[Exception], ...],
    failed: tuple[type[Exception], ...],
    stop: Callable[[SomeNode], bool] | None,
    spun_by: Callable[[SomeNode], Executor],
) -> tuple[bool, int]:
    """Whether nothing goes on that cannot be ended, and the exit code; see :func:`run_node`.

    Apart from it, since an exit keeps the frame that it came from, and an executor that is freed
    only with the interpreter complains.
    """
    # rclpy closes the context at a signal, which ends the spinning; an interrupt raised beside that
    # would strike anywhere, also where Python can only print it.
    signal.signal(signal.SIGINT, lambda number, frame: None)
    try:
        with secured_or_nothing():
            rclpy.init(args=args)
    except NoSecurity as error:
        sys.stderr.write(f'{name}: {error}\n')
        return True, CANNOT_START
    check_parameters_of_nodes()
    node, executor, stopped, code = None, None, True, 0
    try:
        with secured_or_nothing():
            node = create()
        warn_without_clock(node)
        executor = spun_by(node)
        executor.add_node(node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception as error:
        # A signal closes the context at once; what was being made or sent then fails somehow.
        if rclpy.ok():
            if node is None and isinstance(error, (*cannot_start, NoSecurity)):
                code = CANNOT_START
            elif isinstance(error, failed):
                code = FAILED
            else:
                raise
            get_logger(name).fatal(str(error))
    finally:
        if node is not None:
            stopped = stop is None or stop(node)
            node.destroy_node()
        if executor is not None:
            executor.shutdown(timeout_sec=0.0)
        rclpy.try_shutdown()
    return stopped, code
