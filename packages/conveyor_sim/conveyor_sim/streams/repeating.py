"""What a stream draws on, round after round: a list in order or shuffled, a lottery, a recipe."""

from __future__ import annotations

import hashlib
import math
import random
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol

from conveyor_sim.streams.box_records import DEFAULT_DENSITY_KG_PER_MM3, Entry, RejectedRow
from pack_msgs_py.values import Box, Vec3
from pack_msgs_py.wording import how_many

#: Makes the sizes of one round, millimetres, in the order in which the boxes come.
Recipe = Callable[[random.Random], Sequence[Vec3]]


class BoxSource(Protocol):
    """Boxes without end, in rounds of equal length. Ids are unique over all rounds."""

    name: str
    notes: tuple[str, ...]

    @property
    def fingerprint(self) -> str:
        """Equal for sources that give equal boxes."""

    def turn(self, number: int) -> tuple[Entry, ...]:
        """Round ``number``, from 0; the same whenever it is asked for."""

    def has(self, box_id: str, turns: int) -> bool:
        """Whether a box of the first ``turns`` rounds may be called ``box_id``."""


class ListedBoxes:
    """Each row once a round; later rounds append ``#2``, ``#3`` and so on to the ids.

    ``seed`` 0 keeps the order; otherwise every round is shuffled, the same for equal seeds.
    """

    def __init__(
        self, entries: Sequence[Entry], seed: int, name: str, notes: tuple[str, ...] = ()
    ) -> None:
        if not entries:
            msg = f'stream {name} holds no boxes'
            raise ValueError(msg)
        self.name = name
        self.notes = notes
        self._entries = tuple(entries)
        self._seed = seed
        self._ids = {entry_id(entry) for entry in entries}
        self._mark = _free_mark(self._ids)

    @property
    def fingerprint(self) -> str:
        """Digest of seed and rows."""
        return f'{self._seed} {_digest(self._entries)}'

    def turn(self, number: int) -> tuple[Entry, ...]:
        """All rows, in the order of this round."""
        order = list(self._entries)
        if self._seed:
            random.Random(f'{self._seed}/{number}').shuffle(order)
        if number == 0:
            return tuple(order)
        return tuple(_renamed(entry, f'{self._mark}{number + 1}') for entry in order)

    def has(self, box_id: str, turns: int) -> bool:
        """See :class:`BoxSource`."""
        if box_id in self._ids:
            return True
        stem, mark, turn = box_id.rpartition(self._mark)
        return bool(mark) and stem in self._ids and turn.isdecimal() and 2 <= int(turn) <= turns


class DrawnBoxes:
    """Boxes drawn with replacement; the place in the stream, from 1, is appended to each id."""

    def __init__(
        self, entries: Sequence[Entry], seed: int, name: str, notes: tuple[str, ...] = ()
    ) -> None:
        self._boxes = tuple(entry for entry in entries if isinstance(entry, Box))
        if not self._boxes:
            msg = f'stream {name} holds no boxes to draw from'
            raise ValueError(msg)
        self.name = f'{name}, drawn with replacement'
        self.notes = notes
        self._seed = seed
        self._ids = {box.id for box in self._boxes}
        self._mark = _free_mark(self._ids)

    @property
    def fingerprint(self) -> str:
        """Digest of seed and boxes."""
        return f'drawn {self._seed} {_digest(self._boxes)}'

    def turn(self, number: int) -> tuple[Entry, ...]:
        """As many boxes as there are to draw from."""
        rng = random.Random(f'{self._seed}/drawn/{number}')
        first = number * len(self._boxes) + 1
        drawn = rng.choices(self._boxes, k=len(self._boxes))
        return tuple(_renamed(box, f'{self._mark}{n}') for n, box in enumerate(drawn, start=first))

    def has(self, box_id: str, turns: int) -> bool:
        """See :class:`BoxSource`."""
        stem, mark, place = box_id.rpartition(self._mark)
        known = bool(mark) and stem in self._ids and place.isdecimal()
        return known and 1 <= int(place) <= turns * len(self._boxes)


class MadeBoxes:
    """Boxes made by a recipe, new ones in each round, numbered from 1.

    ``turn_length`` is how many the recipe makes. They have the default density.
    """

    notes: tuple[str, ...] = ()

    def __init__(self, recipe: Recipe, turn_length: int, seed: int, prefix: str, name: str) -> None:
        self.name = f'{name}, seed {seed}'
        self._recipe = recipe
        self._length = turn_length
        self._seed = seed
        self._prefix = f'{prefix}-'

    @property
    def fingerprint(self) -> str:
        """Name and first round."""
        return f'{self.name} {_digest(self.turn(0))}'

    def turn(self, number: int) -> tuple[Entry, ...]:
        """One run of the recipe."""
        sizes = self._recipe(random.Random(f'{self._seed}/{number}'))
        if len(sizes) != self._length:
            msg = f'{self.name}: made {how_many(len(sizes), "box")} instead of {self._length}'
            raise RuntimeError(msg)
        first = number * self._length + 1
        return tuple(
            Box(f'{self._prefix}{n}', size, math.prod(size) * DEFAULT_DENSITY_KG_PER_MM3)
            for n, size in enumerate(sizes, start=first)
        )

    def has(self, box_id: str, turns: int) -> bool:
        """See :class:`BoxSource`."""
        number = box_id.removeprefix(self._prefix)
        known = box_id.startswith(self._prefix) and number.isdecimal()
        return known and 1 <= int(number) <= turns * self._length


def entry_id(entry: Entry) -> str:
    """The id of a box or of a rejected row."""
    return entry.id if isinstance(entry, Box) else entry.box_id


def _renamed(entry: Entry, suffix: str) -> Entry:
    if isinstance(entry, RejectedRow):
        return replace(entry, box_id=entry.box_id + suffix)
    return replace(entry, id=entry.id + suffix)


def _free_mark(ids: set[str]) -> str:
    """``#``, or as many of it as no id of the file already ends with before a number."""
    mark = '#'
    while any(re.search(re.escape(mark) + r'[0-9]+$', box_id) for box_id in ids):
        mark += '#'
    return mark


def _digest(entries: Sequence[Entry]) -> str:
    digest = hashlib.sha256()
    for entry in entries:
        if isinstance(entry, Box):
            key: tuple[object, ...] = (
                entry.id,
                entry.size_mm,
                entry.weight_kg,
                entry.allowed_up,
                entry.max_top_load_n,
                entry.destination,
            )
        else:
            key = (entry.box_id, entry.column, entry.value, int(entry.reason))
        digest.update(repr(key).encode())
    return digest.hexdigest()
