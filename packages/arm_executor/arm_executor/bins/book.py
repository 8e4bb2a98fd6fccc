"""The book of bins: what stands in the cell and what is inside, backed by the journal.

Every change is written to the journal first and shown in :attr:`BinBook.state` afterwards, so that
nobody ever sees a bin that a crash could undo.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from arm_executor.bins.book_state import BinHasChanged, BookError, BookState
from arm_executor.bins.doubt import DOUBT, Finder, Recovery, as_written, blocked_bins, sorted_out
from arm_executor.bins.journal import Journal
from arm_executor.bins.records import Attempt, Step, placed_of
from arm_executor.bins.set_aside import held_bins, set_held_bins, vacant_stations
from arm_executor.bins.start_bins import StartBin
from pack_msgs_py.cell_values import BoxEvent, Decision
from pack_msgs_py.codes import BoxEventKind, Reason
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.geometry.resting import with_measured
from pack_msgs_py.values import STATIONS, Bin, BinSpec, PlacedBox

__all__ = ['BinBook', 'BookError', 'BookState', 'Recovery']

#: Depth of the event topics: that many events, and closed bins, are repeated after a restart.
REPEATED = 100


class BinBook:
    """The bins of the cell. Safe to use from any thread; one placement at a time.

    Parameters
    ----------
    journal : where everything is kept.
    spec : kind of every bin.
    count : bins that stand in the cell, 1 to 3; missing ones are opened by :meth:`recover`.
    now : wall clock, seconds since the epoch.
    destinations : what the stations serve at the start, in turn; none for any box anywhere.
    """

    def __init__(
        self,
        journal: Journal,
        spec: BinSpec,
        count: int,
        now: Callable[[], float],
        destinations: Sequence[str] = (),
    ) -> None:
        self._journal = journal
        self._spec = spec
        self._count = count
        self._now = now
        self._destinations = tuple(destinations) or ('',)
        self._lock = threading.RLock()
        self._last_stamp_s = max((event.stamp_s for event in journal.events(REPEATED)), default=0.0)
        self.ids_in_bins = journal.box_ids_in_bins()
        self.attempt: Attempt | None = None
        self.state = BookState(journal.revision())

    @property
    def journal(self) -> Journal:
        """Where everything is kept; hold :attr:`lock` while it is used."""
        return self._journal

    @property
    def lock(self) -> threading.RLock:
        """Held by whoever changes the book, or writes into its journal."""
        return self._lock

    def stamp(self) -> float:
        """Now; but each stamp is younger than the one before, even if the clock was set back."""
        self._last_stamp_s = max(self._now(), self._last_stamp_s + 1e-6)
        return self._last_stamp_s

    # -- start ----------------------------------------------------------------------------------

    def begin_with(self, start: Sequence[StartBin]) -> None:
        """Bins that are part-filled at the start; nothing when the journal has any bin already."""
        with self._lock:
            if self._journal.last_serial():
                return
            with self._journal.transaction():
                for first in start:
                    fresh = self.new_bin(first.bin.station, first.bin.destination)
                    self._journal.add_bin(fresh, self.stamp())
                    for placed in first.bin.boxes:
                        pose = first.poses[placed.box.id]
                        known = replace(placed, measured_mm=None)
                        attempt = Attempt(0, known, fresh.serial, pose, Step.VERIFIED)
                        self._journal.add_attempt(attempt, self.stamp())
                    self._journal.set_measured(first.poses)
            self.ids_in_bins = self._journal.box_ids_in_bins()

    def recover(self, find: Finder = as_written) -> Recovery:
        """Resolve what was under way when the executor died, and open missing bins.

        A box that was only planned is still on the belt. Of one that was picked, or whose release
        had begun, ``find`` says whether it is back on the belt or in its bin; when it cannot, the
        box is unknown, and its bin blocked until :meth:`resolve`. One in its bin must be measured:
        call :meth:`settled`. May be called again after a crash in between.
        """
        with self._lock:
            stations = {bin_.serial: bin_.station for bin_ in self._journal.open_bins()}
            recovery = sorted_out(self._journal.pending(), stations, find)
            text = 'the executor was restarted while the box was in the gripper'
            with self._journal.transaction():
                for attempt in recovery.undecided:
                    event = self._event(attempt, BoxEventKind.UNKNOWN, Reason.FAULT, DOUBT)
                    self._journal.set_step(attempt.id, Step.UNKNOWN, event.stamp_s)
                    self._journal.add_event(event)
                for attempt in recovery.unmeasured:
                    if not attempt.step.in_bin:
                        self._journal.set_step(attempt.id, Step.RELEASING, self.stamp())
                for attempt in recovery.forgotten:
                    self._journal.set_step(attempt.id, Step.FORGOTTEN, self.stamp())
                for attempt in recovery.returned:
                    event = self._event(attempt, BoxEventKind.RETURNED, Reason.FAULT, text)
                    self._journal.set_step(attempt.id, Step.RETURNED, event.stamp_s)
                    self._journal.add_event(event)
                standing = {bin_.station for bin_ in self._journal.open_bins()}
                standing |= vacant_stations(self._journal)
                for number, station in enumerate(STATIONS[: self._count]):
                    if station not in standing:
                        serves = self._destinations[number % len(self._destinations)]
                        self._journal.add_bin(self.new_bin(station, serves), self.stamp())
            self.ids_in_bins = self._journal.box_ids_in_bins()
            self._load()
            return recovery

    def _load(self) -> None:
        bins = self._journal.open_bins()
        poses = {
            attempt.placed.box.id: attempt.pose
            for bin_ in bins
            for attempt in self._journal.attempts_in(bin_.serial)
        }
        held, blocked = held_bins(self._journal), blocked_bins(bins, self._journal.unknown())
        self.state = BookState(self._journal.revision(), bins, poses, held, blocked)

    def new_bin(self, station: str, destination: str) -> Bin:
        """An empty bin with the next serial, for ``station``; nothing is written down."""
        serial = self._journal.last_serial() + 1
        # Revisions start at 1, since 0 asks swap_bin to skip the check.
        name = f'{self._spec.name}-{serial}'
        return Bin(name, serial, self._spec, (), station, 1, destination)

    def settled(self, poses: Mapping[str, Pose], revise: frozenset[int] = frozenset()) -> None:
        """All boxes were measured, outside of a placement; what was in doubt is now verified.

        ``revise`` names serials of bins whose revision grows even though no box was added, so
        that nobody goes on with a plan for what they were.
        """
        with self._lock:
            pending = [attempt for attempt in self._journal.pending() if attempt.step.in_bin]
            grown = revise | {attempt.bin_serial for attempt in pending}
            with self._journal.transaction():
                self._journal.set_measured(poses)
                for attempt in pending:
                    event = self._event(attempt, BoxEventKind.PLACED)
                    self._journal.set_step(attempt.id, Step.VERIFIED, event.stamp_s)
                    self._journal.add_event(event)
                for bin_ in self.state.bins:
                    if bin_.serial in grown:
                        self._journal.set_bin_revision(bin_.serial, bin_.revision + 1)
                self._journal.set_revision(self.state.revision + 1)
            self._load()

    def resolve(self, box_id: str, *, placed: bool, text: str) -> BoxEvent | None:
        """A person has looked for a box in doubt: it is in its bin, or was taken away.

        One in its bin must be measured, which verifies it: call :meth:`settled`. Of one that was
        taken away the event is returned.

        Raises
        ------
        BookError
            No box of this name is in doubt.
        """
        with self._lock:
            in_doubt = {attempt.placed.box.id: attempt for attempt in self._journal.unknown()}
            if box_id not in in_doubt:
                names = ', '.join(map(repr, in_doubt)) or 'none'
                msg = f'box {box_id!r} is not in doubt; in doubt: {names}'
                raise BookError(msg)
            attempt, event = in_doubt[box_id], None
            with self._journal.transaction():
                if placed:
                    self._journal.set_step(attempt.id, Step.PLACED, self.stamp())
                else:
                    event = self._event(attempt, BoxEventKind.REJECTED, Reason.OPERATOR, text)
                    self._journal.set_step(attempt.id, Step.REMOVED, event.stamp_s)
                    self._journal.add_event(event)
                    known = self._bin(attempt.bin_serial)
                    self._journal.set_bin_revision(known.serial, known.revision + 1)
                    self._journal.set_revision(self.state.revision + 1)
                self._journal.note(attempt.id, f'resolved: {text}', self.stamp())
            self.ids_in_bins = self._journal.box_ids_in_bins()
            self._load()
            return event

    def events(self) -> tuple[BoxEvent, ...]:
        """Recent events with their original stamps, oldest first."""
        with self._lock:
            return self._journal.events(REPEATED)

    def closed(self) -> list[tuple[Bin, dict[str, Pose]]]:
        """Bins closed recently, oldest first, each with the poses of its boxes."""
        with self._lock:
            return [
                (bin_, {a.placed.box.id: a.pose for a in self._journal.attempts_in(bin_.serial)})
                for bin_ in self._journal.closed_bins(REPEATED)
            ]

    # -- one placement --------------------------------------------------------------------------

    def begin(self, decision: Decision, goal_id: bytes = bytes(16)) -> None:
        """The arm is about to carry out ``decision``: write it down as planned."""
        with self._lock:
            if self.attempt is not None:
                msg = f'box {self.attempt.placed.box.id!r} is still under way'
                raise BookError(msg)
            target = self.state.find(decision.bin_id)
            if target is None or target.revision != decision.bin_revision:
                msg = f'bin {decision.bin_id!r} has changed since the goal was admitted'
                raise BinHasChanged(msg)
            attempt = Attempt(
                0, placed_of(decision), target.serial, decision.target, goal_id=goal_id
            )
            with self._journal.transaction():
                self.attempt = self._journal.add_attempt(attempt, self.stamp())

    def picked(self) -> BoxEvent:
        """The box is in the gripper."""
        return self._advance(Step.PICKED, BoxEventKind.PICKED)

    def releasing(self) -> None:
        """The pad is about to let go: from now on the box counts as in the bin."""
        self._advance(Step.RELEASING)
        self.ids_in_bins.add(self._running().placed.box.id)

    def placed(self) -> None:
        """The pad has let go."""
        self._advance(Step.PLACED)

    def verified(self, measured: Pose | None, others: Mapping[str, Pose]) -> BoxEvent:
        """The box is in the bin; its pose, and those of the other boxes there, were measured."""
        with self._lock:
            attempt = self._running()
            pose = measured or attempt.target
            poses = {**others, attempt.placed.box.id: pose}
            event = self._event(attempt, BoxEventKind.PLACED)
            target = self._bin(attempt.bin_serial)
            boxes = (
                *(_moved(other, others) for other in target.boxes),
                with_measured(attempt.placed, pose),
            )
            changed = replace(target, boxes=boxes, revision=target.revision + 1)
            with self._journal.transaction():
                self._journal.set_step(attempt.id, Step.VERIFIED, event.stamp_s)
                self._journal.set_measured(poses)
                self._journal.set_bin_revision(changed.serial, changed.revision)
                self._journal.set_revision(self.state.revision + 1)
                self._journal.add_event(event)
            self.state = replace(
                self.state,
                revision=self.state.revision + 1,
                bins=tuple(
                    changed if bin_.serial == changed.serial else bin_ for bin_ in self.state.bins
                ),
                poses={**self.state.poses, **poses},
            )
            self.attempt = None
            return event

    def forgotten(self) -> None:
        """The placement ended before the box was picked: it is still on the belt."""
        self._advance(Step.FORGOTTEN)

    def returned(self, reason: Reason, text: str) -> BoxEvent:
        """The box is back on the belt."""
        event = self._advance(Step.RETURNED, BoxEventKind.RETURNED, reason, text)
        self.ids_in_bins.discard(event.box_id)
        return event

    def lost(self, text: str) -> BoxEvent:
        """Nobody knows where the box is."""
        event = self._advance(Step.LOST, BoxEventKind.LOST, Reason.FAULT, text)
        self.ids_in_bins.discard(event.box_id)
        return event

    def unknown(self, text: str) -> BoxEvent:
        """The executor failed with the box in motion; the next start resolves it."""
        with self._lock:
            attempt = self._running()
            event = self._event(attempt, BoxEventKind.UNKNOWN, Reason.FAULT, text)
            with self._journal.transaction():
                self._journal.note(attempt.id, 'unknown', event.stamp_s)
                self._journal.add_event(event)
            return event

    def _advance(
        self,
        step: Step,
        kind: BoxEventKind | None = None,
        reason: Reason = Reason.NONE,
        text: str = '',
    ) -> BoxEvent:
        with self._lock:
            attempt = self._running()
            event = self._event(attempt, kind or BoxEventKind.UNKNOWN, reason, text)
            with self._journal.transaction():
                self._journal.set_step(attempt.id, step, event.stamp_s)
                if kind is not None:
                    self._journal.add_event(event)
            self.attempt = replace(attempt, step=step) if step.pending else None
            return event

    # -- bins -----------------------------------------------------------------------------------

    def swap(self, bin_id: str, revision: int, destination: str = '') -> tuple[Bin, Bin]:
        """Close ``bin_id`` and open an empty bin at its station; returns both.

        The new one serves ``destination``, or if that is empty the same as the old one.

        :class:`BookError` when there is no such bin, it has changed since ``revision`` (0: not
        checked), or a placement into it is under way.
        """
        with self._lock:
            old = self.state.find(bin_id)
            if old is None:
                names = ', '.join(bin_.id for bin_ in self.state.bins)
                msg = f'there is no open bin {bin_id!r}; open are {names or "none"}'
                raise BookError(msg)
            if old.id in self.state.blocked:
                raise BookError(self.state.blocked[old.id])
            if revision not in (0, old.revision):
                msg = f'bin {bin_id!r} is at revision {old.revision}, you have seen {revision}'
                raise BookError(msg)
            if self.attempt is not None and self.attempt.bin_serial == old.serial:
                msg = f'box {self.attempt.placed.box.id!r} is being placed into bin {bin_id!r}'
                raise BookError(msg)
            new = self.new_bin(old.station, destination or old.destination)
            stamp = self.stamp()
            with self._journal.transaction():
                self._journal.close_bin(old.serial, stamp)
                self._journal.add_bin(new, stamp)
                set_held_bins(self._journal, self.state.held - {old.id})
                self._journal.set_revision(self.state.revision + 1)
            gone = {placed.box.id for placed in old.boxes}
            self.state = replace(
                self.state,
                revision=self.state.revision + 1,
                bins=(*(bin_ for bin_ in self.state.bins if bin_.serial != old.serial), new),
                poses={key: pose for key, pose in self.state.poses.items() if key not in gone},
                held=self.state.held - {old.id},
            )
            return old, new

    def bin_in_use(self) -> str:
        """Id of the bin into which a box was to go that is still on its way; empty for none."""
        attempt = self.attempt
        return '' if attempt is None else self._bin(attempt.bin_serial).id

    # -- helpers --------------------------------------------------------------------------------

    def _running(self) -> Attempt:
        if self.attempt is None:
            msg = 'no placement is under way'
            raise BookError(msg)
        return self.attempt

    def _bin(self, serial: int) -> Bin:
        return next(bin_ for bin_ in self.state.bins if bin_.serial == serial)

    def _event(
        self,
        attempt: Attempt,
        kind: BoxEventKind,
        reason: Reason = Reason.NONE,
        text: str = '',
    ) -> BoxEvent:
        in_bin = kind is BoxEventKind.PLACED
        return BoxEvent(
            attempt.placed.box.id,
            kind,
            reason,
            text,
            f'{self._spec.name}-{attempt.bin_serial}' if in_bin else '',
            attempt.bin_serial if in_bin else 0,
            self.stamp(),
        )


def _moved(placed: PlacedBox, poses: Mapping[str, Pose]) -> PlacedBox:
    pose = poses.get(placed.box.id)
    return placed if pose is None else with_measured(placed, pose)
