"""The verbs of an operator on the command line, and ``cell status`` and ``cell completion``."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from typing import Any

from pack_cell.options.parsers import BadValue, NumberRange
from pack_msgs_py.orientation import ORIENTATIONS, oriented_size
from pack_msgs_py.values import MAX_EDGE_MM, Box, Int3, PlacedBox, check_box

#: How long a verb waits for the cell and for each answer, seconds.
TIMEOUT_S = 10.0
SHELLS = ('bash', 'zsh')


@dataclass(frozen=True)
class OperatorVerb:
    """A verb: what it is called, what it does, and what it is about (``BIN``, ``BOX`` or none)."""

    name: str
    text: str
    about: str = ''


BIN_TEXT = 'a bin by its id, or the station where it stands: A, B or C'
BOX_TEXT = 'the id of the box'

#: All but ``insert`` and ``resolve``, which take more.
OPERATOR_VERBS = (
    OperatorVerb('pause', 'finish the box that is under way, then let arm and belt stand'),
    OperatorVerb('resume', 'go on after a pause'),
    OperatorVerb('stop', 'protective stop: the arm comes to rest at once and keeps what it holds'),
    OperatorVerb('reset', 'after a protective stop: a held box goes back to the belt, and on'),
    OperatorVerb('ack', 'alarms and warnings have been looked at; the arm may move again'),
    OperatorVerb('drain', 'feed no more boxes; those on the belt are still packed'),
    OperatorVerb('feed', 'feed boxes again, after drain or empty'),
    OperatorVerb('empty', 'feed no more boxes, and send those on the belt to the reject lane'),
    OperatorVerb('swap', 'close a bin, or fill an empty station, with an empty bin', 'BIN'),
    OperatorVerb('close', 'close a bin; its station stays empty until a swap', 'BIN'),
    OperatorVerb('hold', 'put no more boxes into a bin, which stays', 'BIN'),
    OperatorVerb('release', 'put boxes into a held bin again', 'BIN'),
    OperatorVerb('remove', 'a box was taken away by hand, off the belt or out of a bin', 'BOX'),
    OperatorVerb('finish', 'the shift ends: empty the belt, close all bins that hold a box'),
)

#: Every verb that works on a running cell.
OPERATING = (*(verb.name for verb in OPERATOR_VERBS), 'insert', 'resolve', 'status')


def add_operate(verbs: Any) -> None:  # noqa: ANN401 - argparse does not name its subparsers
    """Add the verbs to the command line."""
    for verb in OPERATOR_VERBS:
        parser = verbs.add_parser(verb.name, help=verb.text, description=f'{_sentence(verb.text)}')
        if verb.about:
            text = BIN_TEXT if verb.about == 'BIN' else BOX_TEXT
            parser.add_argument('subject', metavar=verb.about, help=text)
        _add_common(parser)
    text = 'a box was laid on the belt, or with --bin put into a bin, by hand'
    insert = verbs.add_parser('insert', help=text, description=_sentence(text))
    insert.add_argument('subject', metavar='BOX', help='a new id for the box')
    insert.add_argument(
        'size', metavar='SIZE', type=box_size, help='its edges as it lies, such as 300x200x150 (mm)'
    )
    insert.add_argument(
        '--kg', type=NumberRange(0, 1000, 'kg', above=True), default=1.0, help='its weight'
    )
    insert.add_argument('--destination', default='', help='where it is bound for')
    insert.add_argument('--bin', dest='bin_id', default='', metavar='BIN', help=BIN_TEXT)
    insert.add_argument(
        '--at',
        type=corner,
        metavar='X,Y,Z',
        help="its corner nearest the bin's origin, millimetres in the bin",
    )
    insert.add_argument(
        '--orientation', choices=ORIENTATIONS, default='xyz', help='box axes along those of the bin'
    )
    _add_common(insert)
    text = 'a box that a crash has left in doubt was looked for'
    resolve = verbs.add_parser('resolve', help=text, description=_sentence(text))
    resolve.add_argument('subject', metavar='BOX', help=BOX_TEXT)
    where = resolve.add_mutually_exclusive_group(required=True)
    where.add_argument('--placed', action='store_true', help='it is in the bin it was bound for')
    where.add_argument('--removed', action='store_true', help='it was taken out of the cell')
    _add_common(resolve)
    status = verbs.add_parser(
        'status',
        help='what the running cell does, what it waits for, and what to do next',
        description='What the running cell does, what it waits for, and what to do next. Exit '
        'code 0: it works, waits or is paused; 1: it needs somebody; 2: there is none.',
    )
    status.add_argument('--json', action='store_true', help='as JSON')
    _add_where(status)
    completion = verbs.add_parser(
        'completion',
        help='print a completion for bash or zsh',
        description='Print a completion: source <(cell completion bash), or for zsh into a file '
        '_cell in a folder of $fpath.',
    )
    completion.add_argument('shell', choices=SHELLS)


def _add_common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('--who', default='', help='your name, for the journal (default: $USER)')
    parser.add_argument('--why', default='', help='the reason, for the journal')
    _add_where(parser)


def _add_where(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        '--domain',
        type=NumberRange(0, 232, whole=True),
        metavar='N',
        help='ROS domain of the cell (default: $ROS_DOMAIN_ID, else the only one in which a cell '
        'of this machine runs, else 0)',
    )
    parser.add_argument(
        '--namespace', metavar='NAME', help='namespace of the cell (default: the only one there)'
    )
    parser.add_argument(
        '--timeout',
        type=NumberRange(0.1, 3600, 's'),
        default=TIMEOUT_S,
        metavar='S',
        help=f'longest wait for the cell and for each answer, seconds (default {TIMEOUT_S:g})',
    )


def _sentence(text: str) -> str:
    return f'{text[0].upper()}{text[1:]}.'


def box_size(text: str) -> tuple[float, float, float]:
    """Edges such as ``300x200x150``, millimetres; :class:`BadValue` when they are none."""
    parts = text.lower().split('x')
    try:
        x, y, z = (float(part) for part in parts)
    except ValueError:
        msg = f'{text!r} is not a size such as 300x200x150, millimetres'
        raise BadValue(msg) from None
    if not all(0 < edge <= MAX_EDGE_MM for edge in (x, y, z)):
        msg = f'{text}: each edge must be above 0 and at most {MAX_EDGE_MM:g} mm'
        raise BadValue(msg)
    return x, y, z


def corner(text: str) -> Int3:
    """A corner such as ``0,300,150``, whole millimetres; :class:`BadValue` when it is none."""
    try:
        x, y, z = (int(part) for part in text.split(','))
    except ValueError:
        msg = f'{text!r} is not a corner such as 0,300,150, whole millimetres'
        raise BadValue(msg) from None
    return x, y, z


def box_of(parsed: argparse.Namespace) -> Box:
    """The box of ``cell insert``; ``ValueError`` when there can be no such box."""
    return check_box(
        Box(parsed.subject, parsed.size, float(parsed.kg), destination=parsed.destination)
    )


def placed_box_of(parsed: argparse.Namespace) -> PlacedBox:
    """The box of ``cell insert --bin`` where it stands.

    Raises
    ------
    ValueError
        Nobody says where in the bin, or there can be no such box.
    """
    if parsed.at is None:
        msg = 'insert --bin needs --at X,Y,Z: where in the bin does the box stand?'
        raise ValueError(msg)
    box = box_of(parsed)
    x, y, z = (-int(-edge // 1) for edge in oriented_size(box.size_mm, parsed.orientation))
    return PlacedBox(box, parsed.at, (x, y, z), parsed.orientation)
