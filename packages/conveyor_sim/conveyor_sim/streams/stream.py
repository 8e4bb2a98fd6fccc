"""The order in which boxes come: how many of a source, and where they are bound for."""

from __future__ import annotations

import hashlib
import random
from collections import OrderedDict
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path

from conveyor_sim.streams.box_records import Entry
from conveyor_sim.streams.by_name import open_source
from conveyor_sim.streams.reading import Reading
from conveyor_sim.streams.repeating import BoxSource, ListedBoxes
from pack_msgs_py.values import Box

#: Rounds kept in memory: the newest, and those that boxes still on the belt are of.
_KEPT_TURNS = 3


class Stream:
    """A finite sequence of boxes and rejected rows, addressed by ordinal from 0.

    Parameters
    ----------
    boxes : a source, or rows of a box file, which then come in order or shuffled with ``seed``.
    count : how many to supply, rejected rows included; 0 for one round of the source.
    seed : see :class:`conveyor_sim.streams.repeating.ListedBoxes`; also of the destinations.
    name : what rows are called in messages.
    destinations : give each box without one a destination ``D1`` to ``D<n>``, at random; 0 leaves
        them as they are.
    """

    def __init__(
        self,
        boxes: BoxSource | Sequence[Entry],
        count: int = 0,
        seed: int = 0,
        name: str = 'boxes',
        destinations: int = 0,
    ) -> None:
        if count < 0 or destinations < 0:
            msg = f'count is {count} and destinations {destinations}; both must be 0 or more'
            raise ValueError(msg)
        self._source = ListedBoxes(boxes, seed, name) if isinstance(boxes, Sequence) else boxes
        self._turns: OrderedDict[int, tuple[Entry, ...]] = OrderedDict()
        self._per_turn = len(self._turn(0))
        self._length = count or self._per_turn
        self._seed = seed
        self._destinations = destinations
        self._lay: Callable[[Box], Box] | None = None
        self.name = self._source.name

    @classmethod
    def open(
        cls,
        choice: str | Path = '',
        count: int = 0,
        seed: int = 0,
        destinations: int = 0,
        reading: Reading | None = None,
    ) -> Stream:
        """The stream that ``choice`` names, the built-in cartons when it is empty.

        Raises
        ------
        BoxFileError
            See :func:`conveyor_sim.streams.by_name.open_source`.
        """
        return cls(open_source(choice, seed, reading), count, seed, destinations=destinations)

    def __len__(self) -> int:
        return self._length

    def __getitem__(self, ordinal: int) -> Entry:
        if not 0 <= ordinal < self._length:
            msg = f'stream {self.name} has {self._length} boxes, no number {ordinal}'
            raise IndexError(msg)
        turn, place = divmod(ordinal, self._per_turn)
        entry = self._turn(turn)[place]
        if self._lay is not None and isinstance(entry, Box):
            entry = self._lay(entry)
        if self._destinations and isinstance(entry, Box) and not entry.destination:
            number = random.Random(f'{self._seed}/to/{ordinal}').randint(1, self._destinations)
            return replace(entry, destination=destination_names(self._destinations)[number - 1])
        return entry

    def __contains__(self, box_id: object) -> bool:
        """Whether some box of the stream may have this id."""
        return self._source.has(str(box_id), -(-self._length // self._per_turn))

    @property
    def first_round(self) -> tuple[Entry, ...]:
        """What the source holds, as often as it does, in its order."""
        return self._turn(0)

    @property
    def notes(self) -> tuple[str, ...]:
        """What people should know of how the file was understood, a line each."""
        return self._source.notes

    @property
    def description(self) -> str:
        """For people: what this stream is."""
        return f'{self.name}, {self._length} boxes, seed {self._seed}'

    @property
    def fingerprint(self) -> str:
        """Equal for equal streams, whatever the file is called."""
        about = f'{self._length} {self._seed} {self._destinations} {self._source.fingerprint}'
        return hashlib.sha256(about.encode()).hexdigest()

    def laid(self, lay: Callable[[Box], Box]) -> Stream:
        """The same stream with each box as ``lay`` puts it down."""
        stream = copy(self)
        stream._lay = lay  # noqa: SLF001 - of the same class
        return stream

    def _turn(self, number: int) -> tuple[Entry, ...]:
        if number not in self._turns:
            self._turns[number] = self._source.turn(number)
            while len(self._turns) > _KEPT_TURNS:
                self._turns.popitem(last=False)
        self._turns.move_to_end(number)
        return self._turns[number]


def destination_names(number: int) -> tuple[str, ...]:
    """The destinations that a stream gives to boxes without one: ``D1`` to ``D<number>``."""
    return tuple(f'D{place}' for place in range(1, number + 1))
