"""What an operator does with the bins: close, swap, hold, put boxes in and take them out."""

from __future__ import annotations

from arm_executor.bins.book import BinBook, BookError
from arm_executor.bins.closings import Closings
from arm_executor.bins.cut_off import CutOffAnswer, CutOffs
from arm_executor.bins.hand_work import HandWork
from arm_executor.bins.set_aside import vacant_stations
from arm_executor.goals.core import ExecutorCore
from arm_executor.goals.outputs import BinClosed, Happened, Said, closed_with
from pack_msgs_py.codes import Mode
from pack_msgs_py.values import Bin, PlacedBox

#: The arm begins no motion in these modes, so that people may reach into the bins.
_ARM_STANDS = (Mode.PAUSED, Mode.ALARM)


class BinWork:
    """All methods are called from one thread, return a sentence, or raise :class:`BookError`."""

    def __init__(self, core: ExecutorCore, book: BinBook) -> None:
        self._core = core
        self._book = book
        self._hand = HandWork(book)
        self._closings = Closings(lambda: book.state.bins, core.bin_in_use)
        self._cut_offs = CutOffs(lambda: book.state.bins, self._closings, core.swap)

    def swap(self, name: str) -> str:
        """Close a bin, by id or station, and open an empty one; or put one at an empty station."""
        self._core.check_usable()
        if name in vacant_stations(self._book.journal):
            new = self._hand.open(name)
            self._core.bins_worked_on()
            return f'empty bin {new.id} stands at station {new.station}'
        old = self._book.state.named(name)
        if self._closings.close(old, self._swap):
            new = self._book.state.named(old.station)
            return f'{closed_with(old)}; empty bin {new.id} is open'
        return f'bin {old.id} is swapped as soon as the box on its way into it rests'

    def _swap(self, bin_: Bin) -> None:
        self._core.swap(bin_.id, 0)

    def close(self, name: str) -> str:
        """Close a bin; its station stays empty."""
        self._core.check_usable()
        old = self._book.state.named(name)
        if self._closings.close(old, self._close):
            station = old.station
            return f'{closed_with(old)}; station {station} stays empty until: cell swap {station}'
        return f'bin {old.id} is closed as soon as the box on its way into it rests'

    def _close(self, bin_: Bin) -> None:
        poses = self._book.state.poses
        old = self._hand.close(bin_.id)
        self._core.emit(BinClosed(old, poses))
        self._core.bins_worked_on()
        self._core.emit(Said('info', f'bin {old.id} closed, station {old.station} is empty'))

    def close_all(self) -> str:
        """Swap every bin that holds a box, or is getting one."""
        self._core.check_usable()
        chosen = [
            bin_ for bin_ in self._book.state.bins if bin_.boxes or self._closings.is_busy(bin_)
        ]
        if not chosen:
            return 'no bin holds a box'
        answers = {bin_.id: self._closings.close(bin_, self._swap_full) for bin_ in chosen}
        closed = [name for name, done in answers.items() if done]
        waits = [name for name, done in answers.items() if not done]
        text = f'closed: {", ".join(closed) or "none yet"}'
        return text + (f'; {", ".join(waits)} once the box on its way rests' if waits else '')

    def _swap_full(self, bin_: Bin) -> None:
        if bin_.boxes:
            self._swap(bin_)

    def hold(self, name: str, *, held: bool) -> str:
        """Keep a bin from being filled, or let it be filled again."""
        self._core.check_usable()
        bin_ = self._book.state.named(name)
        self._hand.hold(name, held=held)
        self._core.bins_worked_on()
        if not held:
            return f'bin {bin_.id} is filled again'
        last = ', after the box on its way into it' if self._closings.is_busy(bin_) else ''
        return f'bin {bin_.id} is held{last}; boxes go into it again after: cell release {bin_.id}'

    def insert(self, name: str, placed: PlacedBox) -> str:
        """A box was put into a bin by hand."""
        self._check_arm_stands()
        event = self._hand.insert(name, placed)
        self._core.emit(Happened(event))
        self._core.bins_worked_on(frozenset({event.bin_serial}))
        return f'box {placed.box.id!r} is in bin {event.bin_id} at {placed.corner_mm} mm'

    def remove(self, box_id: str) -> str:
        """A box was taken out of a bin by hand."""
        self._check_arm_stands()
        serials = frozenset(
            bin_.serial
            for bin_ in self._book.state.bins
            if any(placed.box.id == box_id for placed in bin_.boxes)
        )
        event, above = self._hand.remove(box_id)
        self._core.emit(Happened(event))
        self._core.bins_worked_on(serials)
        look = f'; it carried {", ".join(above)}: look how they stand now' if above else ''
        return f'box {box_id!r} is out of its bin{look}'

    def _check_arm_stands(self) -> None:
        self._core.check_usable()
        mode = self._core.status().mode
        if mode not in _ARM_STANDS:
            msg = f'the arm may move, its mode is {mode.name}: cell pause first'
            raise BookError(msg)

    def cut_off(self, destination: str, next_destination: str) -> CutOffAnswer:
        """Close the bins of a destination."""
        return self._cut_offs.cut_off(destination, next_destination)

    def goal_ended(self) -> None:
        """Bins that are to be closed may now be free."""
        self._closings.goal_ended()
