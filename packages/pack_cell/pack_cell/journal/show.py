"""The books of a run in lines for people."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from datetime import datetime

from pack_cell.journal.run_books import RunBooks
from pack_msgs_py.alarm_table import KeptAlarm
from pack_msgs_py.wording import how_many


def book_lines(books: RunBooks) -> Iterator[str]:
    """Bins with their boxes, where boxes are by the belt's book, what people did, alarms."""
    yield from _bin_lines(books)
    yield from _belt_lines(books)
    if books.operations:
        yield 'asked for by people:'
    for asked in books.operations:
        done = asked.operation
        what = ' '.join(filter(None, [done.command, done.subject]))
        why = f' ({done.why})' if done.why else ''
        who = f'{what} of the {asked.node} by {done.who}{why}'
        refused = '' if done.done else 'refused: '
        yield f'  {_when(done.stamp_s)}  {who}: {refused}{done.answer}'
    if books.alarms:
        yield 'alarms and warnings:'
    for raised in books.alarms:
        kept, alarm = raised.kept, raised.kept.alarm
        said = f'{alarm.severity.name.lower()} {alarm.code} of the {raised.node}: {alarm.message}'
        yield f'  {_when(alarm.raised_s)}  {said}; {_end(kept)}'


def _end(kept: KeptAlarm) -> str:
    """What became of an alarm."""
    ended = '' if kept.ended_s is None else f'over {_when(kept.ended_s)}, '
    if kept.over_s is None:
        return f'{ended}not acknowledged'
    by = f' by {kept.over_by}' if kept.over_by else ''
    why = f' ({kept.over_why})' if kept.over_why else ''
    return f'{ended}acknowledged {_when(kept.over_s)}{by}{why}'


def _bin_lines(books: RunBooks) -> Iterator[str]:
    by_bin = {known.serial: known for known in books.bins}
    for known in books.bins:
        opened_s, closed_s = books.bin_times[known.serial]
        end = 'open' if closed_s is None else f'closed {_when(closed_s)}'
        serves = f', serves {known.destination}' if known.destination else ''
        yield (
            f'bin {known.id} at {known.station}{serves}: {how_many(len(known.boxes), "box")}, '
            f'{known.fill_rate:.1%} full, {known.weight_kg:.1f} kg; '
            f'opened {_when(opened_s)}, {end}'
        )
        for attempt in books.attempts:
            if attempt.bin_serial == known.serial and attempt.step.in_bin:
                x, y, z = attempt.placed.corner_mm
                stamp_s = books.steps[attempt.id][-1][1]
                yield (
                    f'  {_when(stamp_s)}  {attempt.placed.box.id:<24.24} ({x:>4}, {y:>4}, {z:>4}) '
                    f'mm {attempt.placed.orientation}  {attempt.step.value}'
                )
    under_way = [attempt for attempt in books.attempts if attempt.step.pending]
    for attempt in under_way:
        name = by_bin[attempt.bin_serial].id
        yield f'under way: {attempt.placed.box.id} into {name}, {attempt.step.value}'


def _belt_lines(books: RunBooks) -> Iterator[str]:
    if books.fed is None:
        yield 'belt: its book is in use while the cell runs'
        return
    places = Counter(fed.place for fed in books.fed)
    counts = ', '.join(f'{number} {place}' for place, number in sorted(places.items()))
    yield f'belt: {how_many(len(books.fed), "box")} fed: {counts or "none"}'
    for fed in books.fed:
        if fed.place in ('rejected', 'lost'):
            yield f'  {fed.box_id} {fed.place}, {fed.reason.name.lower()}: {fed.text}'


def box_lines(books: RunBooks, box_id: str) -> Iterator[str]:
    """All that is written about one box; nothing when it is not known."""
    for fed in books.fed or ():
        if fed.box_id == box_id:
            laps = how_many(fed.laps, 'lap')
            yield f'number {fed.ordinal + 1} of the stream, {fed.place}, {laps}'
    lines = []
    for attempt in books.attempts:
        if attempt.placed.box.id == box_id:
            what = f'placement {attempt.id} into bin {attempt.bin_serial}'
            lines += [(s, f'{what}: {step}') for step, s in books.steps.get(attempt.id, ())]
    for event in books.events:
        if event.box_id == box_id:
            why = f' ({event.reason.name.lower()}: {event.text})' if event.text else ''
            lines.append((event.stamp_s, f'told: {event.event.name}{why}'))
    for asked in books.operations:
        done = asked.operation
        if done.subject == box_id:
            lines.append((done.stamp_s, f'{done.command} by {done.who}: {done.answer}'))
    for raised in books.alarms:
        alarm = raised.kept.alarm
        if alarm.box_id == box_id:
            lines.append((alarm.raised_s, f'{alarm.code}: {alarm.message}'))
    yield from (f'{_when(stamp_s)}  {text}' for stamp_s, text in sorted(lines))


def _when(stamp_s: float) -> str:
    return datetime.fromtimestamp(stamp_s).strftime('%Y-%m-%d %H:%M:%S')
