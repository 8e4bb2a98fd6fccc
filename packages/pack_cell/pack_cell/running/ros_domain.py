"""Keep cells on one machine apart: each holds a ROS domain of its own."""

from __future__ import annotations

import os
import socket
from pathlib import Path

#: Domains above 101 would use ports of the range Linux hands out to clients.
HIGHEST_DOMAIN = 101


class DomainTaken(RuntimeError):
    """Another cell already runs in the wanted ROS domain."""


class DomainLock:
    """Holds a ROS domain for this process; freed by the kernel when the process ends."""

    def __init__(self, number: int, holder: socket.socket) -> None:
        self.number = number
        self._holder = holder

    def release(self) -> None:
        """Give the domain back."""
        self._holder.close()


def _try_hold(number: int) -> DomainLock | None:
    holder = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        # An abstract address: no file to leave behind, and the kernel frees it with the process.
        holder.bind(f'\0packing-cell-domain-{number}')
    except OSError:
        holder.close()
        return None
    return DomainLock(number, holder)


def hold_domain() -> DomainLock:
    """Hold ``ROS_DOMAIN_ID`` if it is set, else the first free domain of 0, 101, 100, ..., 1.

    From above, because test tools give out domains from 1 upwards.

    Raises
    ------
    DomainTaken
        Another cell runs in the domain that ``ROS_DOMAIN_ID`` names, or in all of them.
    ValueError
        ``ROS_DOMAIN_ID`` is not a whole number from 0 to 232.
    """
    wanted = os.environ.get('ROS_DOMAIN_ID', '').strip()
    if wanted:
        if not wanted.isdigit() or int(wanted) > 232:
            msg = f'ROS_DOMAIN_ID is {wanted!r}; it must be a whole number from 0 to 232'
            raise ValueError(msg)
        lock = _try_hold(int(wanted))
        if lock is None:
            msg = (
                f'another cell runs in ROS domain {wanted}; '
                'unset ROS_DOMAIN_ID, or set it to another number'
            )
            raise DomainTaken(msg)
        return lock
    for number in (0, *range(HIGHEST_DOMAIN, 0, -1)):
        lock = _try_hold(number)
        if lock is not None:
            return lock
    msg = f'cells already run in all ROS domains from 0 to {HIGHEST_DOMAIN}'
    raise DomainTaken(msg)


#: Where Linux tells the flags of the loopback interface, and the one that says that it is up.
_LOOPBACK_FLAGS = Path('/sys/class/net/lo/flags')
_IS_UP = 0x1


def loopback_trouble(flags: Path = _LOOPBACK_FLAGS) -> str:
    """Why nodes on this machine cannot hear each other by the loopback interface; else empty."""
    try:
        is_up = int(flags.read_text(), 16) & _IS_UP
    except (OSError, ValueError):
        return ''
    if is_up:
        return ''
    return 'the loopback interface is down, by which they talk: `sudo ip link set lo up`'
