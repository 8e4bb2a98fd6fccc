"""Security of ROS (SROS2) that is asked for and cannot be had ends a process with a sentence."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager


class NoSecurity(OSError):
    """``ROS_SECURITY_ENABLE`` is true, and this process cannot take part in a secured domain."""


@contextmanager
def secured_or_nothing() -> Iterator[None]:
    """Turn the errors that rcl and the middleware raise for want of security into one sentence.

    Raises
    ------
    NoSecurity
        Security was asked for, and nothing was begun without it.
    """
    try:
        yield
    except RuntimeError as error:  # rclpy's RCLError
        if os.environ.get('ROS_SECURITY_ENABLE') != 'true' or 'security' not in str(error).lower():
            raise
        why = ' '.join(str(error).split())
        msg = (
            f'security is asked for (ROS_SECURITY_ENABLE) and cannot be had, so nothing is begun: '
            f'{why}; see "Who can reach the cell" in docs/reliability.md'
        )
        raise NoSecurity(msg) from None
