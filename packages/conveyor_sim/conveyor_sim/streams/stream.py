"""The order in which boxes come: how many, shuffled or as listed, repeated when there are few."""

from __future__ import annotations

import hashlib
import random
import re
from dataclasses import replace
from pathlib import Path

from conveyor_sim.streams.files import read_entries
from conveyor_sim.streams.rows import Entry, RejectedRow
from pack_msgs_py.values import Box


class Stream:
    """A finite sequence of boxes and rejected rows, addressed by ordinal from 0.

    Parameters
    ----------
    entries : rows of a box file.
    count : how many to supply, rejected rows included; 0 for each row once. Beyond the last row
        the stream starts again, and ids get ``#2``, ``#3`` and so on appended.
    seed : 0 for the order as listed; otherwise every round is shuffled, the same for equal seeds.
    name : what the stream is called in messages.
    """

    def __init__(
        self, entries: tuple[Entry, ...], count: int = 0, seed: int = 0, name: str = 'boxes'
    ) -> None:
        if not entries:
            msg = f'stream {name} holds no boxes'
            raise ValueError(msg)
        if count < 0:
            msg = f'count is {count}; it must be 0 (the whole stream) or more'
            raise ValueError(msg)
        self._entries = entries
        self._length = count or len(entries)
        self._seed = seed
        self._ids = {_id(entry) for entry in entries}
        self._mark = _free_mark(self._ids)
        self._round: tuple[int, list[int]] | None = None
        self.name = name

    @classmethod
    def from_file(cls, path: str | Path = '', count: int = 0, seed: int = 0) -> Stream:
        """A stream from a box file, the built-in one when ``path`` is empty.

        Raises
        ------
        BoxFileError
            See :func:`conveyor_sim.streams.files.load_boxes`.
        """
        name = Path(path).name if str(path) else 'built-in cartons'
        return cls(read_entries(path), count, seed, name)

    def __len__(self) -> int:
        return self._length

    def __getitem__(self, ordinal: int) -> Entry:
        if not 0 <= ordinal < self._length:
            msg = f'stream {self.name} has {self._length} boxes, no number {ordinal}'
            raise IndexError(msg)
        turn, place = divmod(ordinal, len(self._entries))
        entry = self._entries[self._order(turn)[place]]
        if turn == 0:
            return entry
        suffix = f'{self._mark}{turn + 1}'
        if isinstance(entry, RejectedRow):
            return replace(entry, box_id=entry.box_id + suffix)
        return replace(entry, id=entry.id + suffix)

    def __contains__(self, box_id: object) -> bool:
        """Whether some box of the stream may have this id."""
        if box_id in self._ids:
            return True
        stem, mark, turn = str(box_id).rpartition(self._mark)
        turns = -(-self._length // len(self._entries))
        return bool(mark) and stem in self._ids and turn.isdecimal() and 2 <= int(turn) <= turns

    @property
    def description(self) -> str:
        """For people: what this stream is."""
        return f'{self.name}, {self._length} boxes, seed {self._seed}'

    @property
    def fingerprint(self) -> str:
        """Equal for equal streams, whatever the file is called."""
        digest = hashlib.sha256(f'{self._length} {self._seed}'.encode())
        for entry in self._entries:
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

    def _order(self, turn: int) -> list[int]:
        if self._round is None or self._round[0] != turn:
            order = list(range(len(self._entries)))
            if self._seed:
                random.Random(f'{self._seed}/{turn}').shuffle(order)
            self._round = (turn, order)
        return self._round[1]


def _id(entry: Entry) -> str:
    return entry.id if isinstance(entry, Box) else entry.box_id


def _free_mark(ids: set[str]) -> str:
    """``#``, or as many of it as no id of the file already ends with before a number."""
    mark = '#'
    while any(re.search(re.escape(mark) + r'[0-9]+$', one) for one in ids):
        mark += '#'
    return mark
