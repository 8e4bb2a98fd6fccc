"""Which cells run on this machine, by the ROS domains that they hold."""

from __future__ import annotations

import os
import re
from pathlib import Path

#: Where Linux lists the sockets by which cells hold their domains (see ``running.ros_domain``).
_SOCKETS = Path('/proc/net/unix')
_HELD = re.compile(r'@packing-cell-domain-(\d+)$')


class NoCell(RuntimeError):
    """There is no cell to be worked, or more than one; the text says what to do."""


def held_domains(sockets: Path = _SOCKETS) -> list[int]:
    """The ROS domains in which cells of this machine run, by ``cell run`` or ``cell demo``."""
    try:
        lines = sockets.read_text(errors='replace').splitlines()
    except OSError:
        return []
    found = (_HELD.search(line) for line in lines)
    return sorted({int(match.group(1)) for match in found if match is not None})


def domain_of_cell(asked: int | None, sockets: Path = _SOCKETS) -> int:
    """The domain to look in: the one that was asked for, else ``ROS_DOMAIN_ID``, else the only one.

    Without any it is 0, where a cell that was launched runs.

    Raises
    ------
    NoCell
        Several cells run, and nobody says which; or ``ROS_DOMAIN_ID`` is no number.
    """
    if asked is not None:
        return asked
    wanted = os.environ.get('ROS_DOMAIN_ID', '').strip()
    if wanted:
        if not wanted.isdigit():
            msg = f'ROS_DOMAIN_ID is {wanted!r}; it must be a whole number from 0 to 232'
            raise NoCell(msg)
        return int(wanted)
    held = held_domains(sockets)
    if len(held) > 1:
        names = ', '.join(map(str, held))
        msg = f'cells run in the ROS domains {names}: say which with --domain'
        raise NoCell(msg)
    return held[0] if held else 0


def namespace_of_cell(asked: str | None, seen: set[str], domain: int) -> str:
    """The namespace to work in: the one that was asked for, else the only one with a cell.

    ``seen`` : namespaces that have one, each ``/`` or ``/name``.

    Raises
    ------
    NoCell
        No cell is seen in ``domain``, or several.
    """
    if asked is not None:
        wanted = '/' + asked.strip('/')
        if wanted not in seen:
            here = ', '.join(sorted(seen)) or 'none'
            msg = (
                f'no cell in namespace {wanted} of ROS domain {domain}; namespaces with one: {here}'
            )
            raise NoCell(msg)
        return wanted
    if not seen:
        msg = f'no cell runs in ROS domain {domain}: start one with cell run, or say --domain'
        raise NoCell(msg)
    if len(seen) > 1:
        names = ', '.join(sorted(seen))
        msg = f'cells run in the namespaces {names}: say which with --namespace'
        raise NoCell(msg)
    return next(iter(seen))
