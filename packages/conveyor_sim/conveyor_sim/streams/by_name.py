"""One way to name a stream, for `cell run`, `cell bench` and the node alike.

FILE                       a box file: CSV, XLSX, JSON or BED-BPP
cartons                    the built-in list of 40 cartons; also the empty text
br:FILE#PROBLEM[,scale=X]  a container-loading problem, thpack1 to thpack9 of the OR-Library
run:FOLDER                 the boxes of an earlier run in the order of its feed
syn[:boxes=23,seed=N]      ten SYN bins cut into boxes, ten new ones each round
mpv:class=1..9[,boxes=100,edge=500,seed=N]   Martello, Pisinger and Vigo; edge of the bin in mm
draw:ANY OF THESE          boxes drawn from one round of it with replacement
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from pathlib import Path

from conveyor_sim.streams import mpv, syn
from conveyor_sim.streams.box_records import BoxFileError, Entry, RejectedRow
from conveyor_sim.streams.br_file import br_boxes
from conveyor_sim.streams.files import read_boxes, read_entries
from conveyor_sim.streams.reading import Reading
from conveyor_sim.streams.repeating import BoxSource, DrawnBoxes, ListedBoxes, MadeBoxes
from conveyor_sim.streams.run_folder import read_run
from pack_msgs_py.values import Box, Vec3, parse_bin

KINDS = ('cartons', 'br', 'run', 'syn', 'mpv', 'draw')
SYNTAX = (
    'FILE (CSV, XLSX, JSON or BED-BPP), cartons, syn[:boxes=23,seed=N], mpv:class=1..9[,boxes=100,'
    'edge=500,seed=N], br:FILE#PROBLEM[,scale=X], run:FOLDER, or draw:ANY OF THESE'
)
_MAX_SEED = 2**31 - 1


def open_source(
    choice: str | Path = '', seed: int = 0, reading: Reading | None = None
) -> BoxSource:
    """The source that ``choice`` names; ``seed`` is used where it gives none itself.

    Raises
    ------
    BoxFileError
        The choice or its file cannot be used; the text says why.
    """
    text = str(choice)
    kind, _, rest = text.partition(':')
    if reading is not None and reading != Reading() and not (is_file(text) or kind == 'draw'):
        msg = f'--boxes {text or "cartons"}: units, decimal and order_by are for box files alone'
        raise BoxFileError(msg)
    if text in ('', 'cartons'):
        return ListedBoxes(read_entries(''), seed, 'built-in cartons')
    if is_file(text):
        found = read_boxes(text, reading)
        return ListedBoxes(found.entries, seed, Path(text).name, found.notes)
    if kind == 'draw':
        inner = open_source(rest, seed, reading)
        return DrawnBoxes(inner.turn(0), seed, inner.name, inner.notes)
    if kind == 'br':
        return _container(rest, seed)
    if kind == 'run':
        folder = Path(rest).expanduser()
        return ListedBoxes(read_run(folder), seed, f'run {folder.name}')
    if kind == 'syn':
        return _syn(_options(rest, kind, ('boxes', 'seed')), seed)
    if kind == 'mpv':
        return _mpv(_options(rest, kind, ('class', 'boxes', 'edge', 'seed')), seed)
    msg = f'--boxes {text!r}: cartons take no options; use one of {SYNTAX}'
    raise BoxFileError(msg)


def is_file(choice: str) -> bool:
    """Whether ``choice`` names a file, and not a stream."""
    kind, colon, _ = choice.partition(':')
    known = choice in ('', 'cartons') or (kind in KINDS and (colon or kind in ('syn', 'mpv')))
    return not known


def resolved(choice: str) -> str:
    """``choice`` with the path in it made absolute, for a process that runs elsewhere."""
    return with_path(choice, lambda path: path.expanduser().resolve())


def with_path(choice: str, change: Callable[[Path], Path]) -> str:
    """``choice`` with the path in it changed; one that needs no file stays as it is."""
    kind, colon, rest = choice.partition(':')
    if choice in ('', 'cartons') or (kind in ('syn', 'mpv') and (colon or kind == choice)):
        return choice
    if colon and kind == 'draw':
        return f'draw:{with_path(rest, change)}'
    if colon and kind == 'br':
        file, mark, after = rest.rpartition('#')
        return f'br:{change(Path(file))}{mark}{after}'
    if colon and kind == 'run':
        return f'run:{change(Path(rest))}'
    return str(change(Path(choice)))


def load_boxes(
    choice: str | Path = '', seed: int = 0, reading: Reading | None = None
) -> tuple[list[Box], list[RejectedRow]]:
    """Boxes and rejected rows of one round of what ``choice`` names.

    Raises
    ------
    BoxFileError
        See :func:`open_source`.
    """
    entries: tuple[Entry, ...] = open_source(choice, seed, reading).turn(0)
    boxes = [entry for entry in entries if isinstance(entry, Box)]
    return boxes, [entry for entry in entries if isinstance(entry, RejectedRow)]


def _container(rest: str, seed: int) -> BoxSource:
    file, mark, after = rest.rpartition('#')
    problem, comma, more = after.partition(',')
    if not mark or not problem.isdecimal():
        msg = f'br:{rest} does not say which problem: write br:FILE#PROBLEM, such as br:BR1.txt#12'
        raise BoxFileError(msg)
    options = _options(more, 'br', ('scale',)) if comma else {}
    scale = _number(options, 'scale', 1.0, low=0.001, high=10.0)
    path = Path(file).expanduser()
    boxes = br_boxes(path, int(problem), scale)
    return ListedBoxes(boxes, seed, f'{path.name} problem {problem}')


def _syn(options: Mapping[str, str], seed: int) -> BoxSource:
    pieces = _whole(options, 'boxes', syn.BOXES_PER_BIN, syn.LEAST_PIECES, 100)
    seed = _whole(options, 'seed', seed, 0, _MAX_SEED)
    spec = parse_bin('SYN')

    def recipe(rng: random.Random) -> list[Vec3]:
        return syn.cut_bins(spec, pieces, rng)

    try:
        length = len(recipe(random.Random(0)))
    except ValueError as error:
        raise BoxFileError(str(error)) from None
    return MadeBoxes(recipe, length, seed, 'syn', f'SYN cut into {pieces} boxes a bin')


def _mpv(options: Mapping[str, str], seed: int) -> BoxSource:
    number = _whole(options, 'class', 0, 1, 9)
    count = _whole(options, 'boxes', 100, 3, 100_000)
    edge = _number(options, 'edge', 500.0, low=10.0, high=10_000.0)
    seed = _whole(options, 'seed', seed, 0, _MAX_SEED)
    unit = edge / mpv.bin_units(number)

    def recipe(rng: random.Random) -> list[Vec3]:
        return mpv.boxes_of_class(number, count, unit, rng)

    return MadeBoxes(recipe, count, seed, f'mpv{number}', f'MPV class {number}, bin {edge:g} mm')


def _options(text: str, kind: str, known: tuple[str, ...]) -> dict[str, str]:
    options: dict[str, str] = {}
    for item in filter(None, text.split(',')):
        name, equals, value = item.partition('=')
        if name not in known or not equals or name in options:
            msg = f'{kind}:{text}: {item!r} is not one of {", ".join(f"{n}=..." for n in known)}'
            raise BoxFileError(msg)
        options[name] = value
    return options


def _whole(options: Mapping[str, str], name: str, default: int, low: int, high: int) -> int:
    text = options.get(name, str(default))
    if not text.isdecimal() or not low <= int(text) <= high:
        msg = f'{name}={text} is not a whole number from {low} to {high}'
        raise BoxFileError(msg)
    return int(text)


def _number(
    options: Mapping[str, str], name: str, default: float, *, low: float, high: float
) -> float:
    text = options.get(name, str(default))
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        msg = f'{name}={text} is not a number from {low:g} to {high:g}'
        raise BoxFileError(msg)
    return value
