"""What the book of bins shows, and why it may refuse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.values import Bin


class BookError(Exception):
    """The bins do not allow what was asked; the text says why."""


class BinHasChanged(BookError):
    """The bin is another than the one that was decided for: decide again."""


@dataclass(frozen=True)
class BookState:
    """Every bin that stands in the cell, oldest first, and the pose of each box in them.

    ``poses`` are of the boxes' centres, in the frame of their bin, by box id. ``held`` are the ids
    of bins that an operator keeps from being filled; ``blocked`` says of bins, by their ids, why
    nobody may work on them.
    """

    revision: int
    bins: tuple[Bin, ...] = ()
    poses: Mapping[str, Pose] = field(default_factory=dict)
    held: frozenset[str] = frozenset()
    blocked: Mapping[str, str] = field(default_factory=dict)

    def find(self, bin_id: str) -> Bin | None:
        """The open bin called ``bin_id``."""
        return next((bin_ for bin_ in self.bins if bin_.id == bin_id), None)

    def named(self, name: str) -> Bin:
        """The open bin called ``name``, or that stands at the station ``name``.

        :class:`BookError` when there is none.
        """
        for bin_ in self.bins:
            if name in (bin_.id, bin_.station):
                return bin_
        names = ', '.join(f'{bin_.id} at {bin_.station}' for bin_ in self.bins)
        msg = f'there is no open bin {name!r}; open are {names or "none"}'
        raise BookError(msg)
