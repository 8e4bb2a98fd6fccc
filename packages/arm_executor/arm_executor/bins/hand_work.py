"""What people do to the bins by hand; the book follows, and the journal holds it first."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Protocol

from arm_executor.bins.book_state import BookError, BookState
from arm_executor.bins.journal import Journal
from arm_executor.bins.records import Attempt, Step
from arm_executor.bins.set_aside import set_held_bins, set_vacant_stations, vacant_stations
from pack_msgs_py.cell_values import BoxEvent
from pack_msgs_py.codes import BoxEventKind, Reason
from pack_msgs_py.geometry.footprint import true_size
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.geometry.resting import with_measured
from pack_msgs_py.orientation import QUATERNIONS
from pack_msgs_py.statics import supporters
from pack_msgs_py.values import STATIONS, Bin, PlacedBox

#: Boxes whose planned heights differ by less stand on each other.
TOUCHING_MM = 5


class _Book(Protocol):
    """What of the book the work by hand needs."""

    state: BookState
    ids_in_bins: set[str]

    @property
    def lock(self) -> threading.RLock: ...

    @property
    def journal(self) -> Journal: ...

    def stamp(self) -> float: ...

    def bin_in_use(self) -> str: ...

    def new_bin(self, station: str, destination: str) -> Bin: ...


class HandWork:
    """Changes ``book`` as people have changed the bins. Safe to use from any thread."""

    def __init__(self, book: _Book) -> None:
        self._book = book

    def hold(self, bin_id: str, *, held: bool) -> None:
        """Keep a bin from being filled, or let it be filled again."""
        book = self._book
        with book.lock:
            bin_ = book.state.named(bin_id)
            if (bin_.id in book.state.held) == held:
                msg = f'bin {bin_.id} is {"held already" if held else "not held"}'
                raise BookError(msg)
            ids = book.state.held | {bin_.id} if held else book.state.held - {bin_.id}
            # The revision grows, so that nobody goes on with a plan for what it was.
            with book.journal.transaction():
                set_held_bins(book.journal, ids)
                self._write_grown(bin_)
            self._show(bin_, bin_.boxes, {}, held=ids)

    def close(self, bin_id: str) -> Bin:
        """Take a bin away; its station stays empty until :meth:`open`. Returns the bin."""
        book = self._book
        with book.lock:
            old = self._free_to_work_on(bin_id)
            if old.id == book.bin_in_use():
                msg = f'a box is being placed into bin {old.id!r}'
                raise BookError(msg)
            with book.journal.transaction():
                book.journal.close_bin(old.serial, book.stamp())
                set_vacant_stations(book.journal, {*vacant_stations(book.journal), old.station})
                set_held_bins(book.journal, book.state.held - {old.id})
                book.journal.set_revision(book.state.revision + 1)
            gone = {placed.box.id for placed in old.boxes}
            book.state = replace(
                book.state,
                revision=book.state.revision + 1,
                bins=tuple(bin_ for bin_ in book.state.bins if bin_.serial != old.serial),
                poses={key: pose for key, pose in book.state.poses.items() if key not in gone},
                held=book.state.held - {old.id},
            )
            return old

    def _free_to_work_on(self, name: str) -> Bin:
        """The open bin called ``name``; :class:`BookError` when there is none or it is blocked."""
        state = self._book.state
        known = state.named(name)
        if known.id in state.blocked:
            raise BookError(state.blocked[known.id])
        return known

    def open(self, station: str, destination: str = '') -> Bin:
        """Put an empty bin at a station that was left empty."""
        book = self._book
        with book.lock:
            if station not in vacant_stations(book.journal):
                empty = ', '.join(
                    name for name in STATIONS if name in vacant_stations(book.journal)
                )
                msg = f'station {station!r} is not empty; empty are {empty or "none"}'
                raise BookError(msg)
            new = book.new_bin(station, destination)
            with book.journal.transaction():
                book.journal.add_bin(new, book.stamp())
                set_vacant_stations(book.journal, {*vacant_stations(book.journal)} - {station})
                book.journal.set_revision(book.state.revision + 1)
            book.state = replace(
                book.state, revision=book.state.revision + 1, bins=(*book.state.bins, new)
            )
            return new

    def insert(self, bin_id: str, placed: PlacedBox) -> BoxEvent:
        """A box was put into a bin by hand.

        Raises
        ------
        BookError
            It is in a bin already, is the one on its way, or cannot be where it is said to be.
        """
        book = self._book
        with book.lock:
            target = self._free_to_work_on(bin_id)
            self._check_free(target, placed)
            pose = hand_pose(placed)
            stamp = book.stamp()
            event = BoxEvent(
                placed.box.id,
                BoxEventKind.PLACED,
                Reason.OPERATOR,
                'put in by hand',
                target.id,
                target.serial,
                stamp,
            )
            attempt = Attempt(0, placed, target.serial, pose, Step.VERIFIED)
            with book.journal.transaction():
                book.journal.add_attempt(attempt, stamp)
                book.journal.set_measured({placed.box.id: pose})
                book.journal.add_event(event)
                self._write_grown(target)
            book.ids_in_bins.add(placed.box.id)
            boxes = (*target.boxes, with_measured(placed, pose))
            self._show(target, boxes, {placed.box.id: pose})
            return event

    def _check_free(self, target: Bin, placed: PlacedBox) -> None:
        box_id, book = placed.box.id, self._book
        if box_id in book.ids_in_bins:
            msg = f'box {box_id!r} is in a bin already; take it out first: cell remove {box_id}'
            raise BookError(msg)
        if target.id == book.bin_in_use():
            msg = f'a box is being placed into bin {target.id!r}; pause the arm, and try again'
            raise BookError(msg)
        for axis, low, high, edge in zip(
            'xyz', placed.corner_mm, placed.far_mm, target.spec.size_mm, strict=True
        ):
            if low < 0 or high > edge:
                msg = (
                    f'box {box_id!r} would reach from {low} to {high} mm along {axis}, '
                    f'bin {target.id} from 0 to {edge} mm'
                )
                raise BookError(msg)
        for other in target.boxes:
            if _overlap(placed, other):
                msg = (
                    f'box {box_id!r} at {placed.corner_mm} mm would stand in box '
                    f'{other.box.id!r} at {other.corner_mm} mm'
                )
                raise BookError(msg)

    def remove(self, box_id: str) -> tuple[BoxEvent, tuple[str, ...]]:
        """A box was taken out of an open bin by hand; also says which boxes stood on it.

        :class:`BookError` when it is in no open bin, or a box is on its way into that bin.
        """
        book = self._book
        with book.lock:
            found = [
                (bin_, placed)
                for bin_ in book.state.bins
                for placed in bin_.boxes
                if placed.box.id == box_id
            ]
            if not found:
                where = 'a bin that was taken away' if box_id in book.ids_in_bins else 'no bin'
                msg = f'box {box_id!r} is in {where}'
                raise BookError(msg)
            target, placed = found[0]
            if target.id == book.bin_in_use():
                msg = f'a box is being placed into bin {target.id!r}; pause the arm, and try again'
                raise BookError(msg)
            stamp = book.stamp()
            event = BoxEvent(
                box_id,
                BoxEventKind.REJECTED,
                Reason.OPERATOR,
                'taken out by hand',
                target.id,
                target.serial,
                stamp,
            )
            number = next(
                attempt.id
                for attempt in book.journal.attempts_in(target.serial)
                if attempt.placed.box.id == box_id
            )
            with book.journal.transaction():
                book.journal.set_step(number, Step.REMOVED, stamp)
                book.journal.add_event(event)
                self._write_grown(target)
            book.ids_in_bins.discard(box_id)
            boxes = tuple(other for other in target.boxes if other.box.id != box_id)
            self._show(target, boxes, {}, gone=box_id)
            above = tuple(
                other.box.id
                for other in boxes
                if placed in supporters(other, [placed], TOUCHING_MM)
            )
            return event, above

    def _write_grown(self, bin_: Bin) -> None:
        self._book.journal.set_bin_revision(bin_.serial, bin_.revision + 1)
        self._book.journal.set_revision(self._book.state.revision + 1)

    def _show(
        self,
        bin_: Bin,
        boxes: tuple[PlacedBox, ...],
        poses: dict[str, Pose],
        *,
        gone: str = '',
        held: frozenset[str] | None = None,
    ) -> None:
        state = self._book.state
        changed = replace(bin_, boxes=boxes, revision=bin_.revision + 1)
        kept = {key: pose for key, pose in state.poses.items() if key != gone}
        self._book.state = replace(
            state,
            revision=state.revision + 1,
            bins=tuple(changed if each.serial == bin_.serial else each for each in state.bins),
            poses={**kept, **poses},
            held=state.held if held is None else held,
        )


def hand_pose(placed: PlacedBox) -> Pose:
    """Pose of the centre of a box that was put where it was planned, bin frame, metres."""
    size = true_size(placed)
    x, y, z = (
        (corner + edge / 2) / 1000
        for corner, edge in zip(
            placed.corner_mm, (placed.size_mm[0], placed.size_mm[1], size[2]), strict=True
        )
    )
    return Pose((x, y, z), QUATERNIONS[placed.orientation])


def _overlap(one: PlacedBox, other: PlacedBox) -> bool:
    return all(
        low < other_far and other_low < far
        for low, far, other_low, other_far in zip(
            one.corner_mm, one.far_mm, other.corner_mm, other.far_mm, strict=True
        )
    )
