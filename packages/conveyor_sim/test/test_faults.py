"""What goes wrong on the belt: every box ends in one place, with the reason that the fault has."""

from collections import Counter
from dataclasses import replace

import pytest
from conveyor_rig import EPOCH, SIZE, ConveyorRig

from conveyor_sim.ledger.ledger import Whereabouts
from conveyor_sim.scanning import faults as known
from conveyor_sim.scanning.fault_plan import FaultPlan, parse_faults
from conveyor_sim.scanning.faults import FAULTS
from conveyor_sim.streams import RejectedRow
from pack_msgs_py.cell_values import BoxEvent
from pack_msgs_py.codes import BoxEventKind, Reason
from pack_msgs_py.values import Box

TEN = tuple(Box(f'b{n}', SIZE, 2.0) for n in range(10))


def cell_with(fault, at, *, folder='', entries=TEN, **parameters):
    """A cell in which ``fault`` befalls the box at place ``at`` alone."""
    for seed in range(1, 5000):
        plan = FaultPlan({fault: 0.1}, seed)
        if [n for n in range(len(entries)) if plan.of(n) is not None] == [at]:
            break
    else:
        pytest.fail('no seed does that')

    return ConveyorRig(entries, folder=folder, faults=f'{fault.name}=0.1', seed=seed, **parameters)


def record(cell, box_id):
    return cell.conveyor._book.record(box_id)


def returned(cell, box_id, reason=Reason.INVALID_DATA):
    cell.wait(0.1)
    event = BoxEvent(box_id, BoxEventKind.RETURNED, reason, 'weighs 2 kg', stamp_s=EPOCH + cell.now)
    return cell.conveyor.on_event(event, *cell.clock())


def failed_grasp(cell, box_id, ended=0.0):
    ended_s = EPOCH + cell.now + ended
    return cell.conveyor.on_empty_grasp(box_id, 'the arm found no box', ended_s, *cell.clock())


def pack(cell, limit=200):
    """Place the nearest box again and again until all are gone; the places in the end."""
    for _ in range(limit):
        ids = cell.ids()
        if not ids:
            break
        cell.wait(1.0)
        cell.decide(ids[0])
        cell.wait(1.0)
        if ids[0] in cell.ids():
            cell.event(ids[0], BoxEventKind.PICKED)
            cell.wait(1.0)
            cell.event(ids[0], BoxEventKind.PLACED)
    assert cell.conveyor.ended
    return Counter(place for place, n in cell.conveyor.counts.items() for _ in range(n))


# naming them


def test_rates_are_named_by_fault_and_later_ones_win():
    assert parse_faults('') == {}
    assert parse_faults('no_read=0.01, touching=0.005') == {
        known.NO_READ: 0.01,
        known.TOUCHING: 0.005,
    }
    rates = parse_faults('all=0.01,fallen=0')
    assert set(rates) == set(FAULTS)
    assert (rates[known.FALLEN], rates[known.DAMAGED]) == (0.0, 0.01)


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('magic=0.1', 'unknown fault .magic.: use all, no_read'),
        ('no_read', "no_read is ''; it must be a number from 0 to 1"),
        ('no_read=nan', 'from 0 to 1'),
        ('no_read=-0.1', 'from 0 to 1'),
        ('no_read=1.5', 'from 0 to 1'),
        ('all=0.2', f'add up to {0.2 * len(FAULTS):g}'),
    ],
)
def test_a_rate_that_cannot_be_is_refused(text, words):
    with pytest.raises(ValueError, match=words):
        parse_faults(text)


def test_faults_come_as_often_as_asked_and_the_same_for_equal_seeds():
    plan, again = (FaultPlan(parse_faults('all=0.05'), 7) for _ in range(2))
    befallen = [plan.of(n) for n in range(20_000)]
    assert befallen == [again.of(n) for n in range(20_000)]
    counts = Counter(befallen)
    assert all(850 < counts[fault] < 1150 for fault in FAULTS)


# each of them


@pytest.mark.parametrize(
    ('fault', 'reason', 'words'),
    [
        (known.OVERSIZE, Reason.OVERSIZE, 'across the belt'),
        (known.DUPLICATE_ID, Reason.DUPLICATE_ID, 'which was seen before'),
    ],
)
def test_what_the_induct_stops_never_rides(fault, reason, words):
    cell = cell_with(fault, 3)
    (event,) = cell.started.events
    assert (event.box_id, event.event, event.reason) == (
        'b3',
        BoxEventKind.REJECTED,
        reason,
    )
    assert words in event.text
    assert pack(cell) == {Whereabouts.PLACED: 9, Whereabouts.REJECTED: 1}


def test_a_box_that_is_not_read_is_scanned_again_and_rejected_after_two_scans():
    seen = Counter()
    for at in range(6):
        cell = cell_with(known.NO_READ, at, slots=6)
        name = cell.stream[at].id
        seen[record(cell, name).place] += 1
        if record(cell, name).place is Whereabouts.REJECTED:
            (event,) = cell.started.events
            assert (event.reason, event.text) == (Reason.NO_READ, f'{name}: not read in 2 scans')
        else:
            assert record(cell, name).scans == 2
            assert any('not read at the first scan' in note for note in cell.started.notes)
    assert seen[Whereabouts.REJECTED] and seen[Whereabouts.ON_BELT]


def test_an_overweight_box_is_stopped_or_its_weight_is_told():
    seen = set()
    for at in range(5):
        cell = cell_with(known.OVERWEIGHT, at)
        name = cell.stream[at].id
        where = record(cell, name).place
        seen.add(where)
        if where is Whereabouts.REJECTED:
            assert cell.started.events[0].reason is Reason.OVERWEIGHT
        else:
            (box,) = (item.box for item in cell.scan().boxes if item.box.id == name)
            assert 22.0 <= box.weight_kg <= 50.0
    assert Whereabouts.ON_BELT in seen


def test_a_damaged_box_may_carry_nothing():
    cell = cell_with(known.DAMAGED, 2)
    loads = {item.box.id: item.box.max_top_load_n for item in cell.scan().boxes}
    assert [name for name, load in loads.items() if load == 0.0] == [cell.stream[2].id]


def test_a_wrong_size_is_told_once_and_the_second_scan_is_right():
    cell = cell_with(known.WRONG_SIZE, 1)
    name = cell.stream[1].id

    def edges():
        (box,) = (item.box for item in cell.scan().boxes if item.box.id == name)
        return box.size_mm

    wrong = edges()
    assert sum(a != b for a, b in zip(wrong, SIZE, strict=True)) == 1
    (true,) = (true.box for true in cell.conveyor.true_boxes(cell.now) if true.box.id == name)
    assert true.size_mm == SIZE
    cell.event(name, BoxEventKind.PICKED)
    news = returned(cell, name)
    assert any('scanned again' in note for note in news.notes)
    cell.event(cell.ids()[0], BoxEventKind.PICKED)
    assert edges() == SIZE
    cell.wait()
    cell.event(name, BoxEventKind.PICKED)
    (event,) = returned(cell, name).events
    assert (event.event, event.reason) == (BoxEventKind.REJECTED, Reason.INVALID_DATA)
    assert record(cell, name).place is Whereabouts.REJECTED


def test_a_box_that_the_arm_brings_back_for_another_reason_is_not_scanned_again():
    cell = ConveyorRig(TEN)
    cell.event('b0', BoxEventKind.PICKED)
    returned(cell, 'b0', Reason.FAULT)
    assert (record(cell, 'b0').place, record(cell, 'b0').scans) == (Whereabouts.ON_BELT, 1)


def test_two_boxes_that_touch_are_read_as_one_and_fed_one_by_one_once_it_is_noticed():
    cell = cell_with(known.TOUCHING, 1)
    first, second = cell.stream[1].id, cell.stream[2].id
    (seen,) = (item.box for item in cell.scan().boxes if item.box.id == first)
    assert (seen.size_mm, seen.weight_kg) == ((300.0, 400.0, 100.0), 4.0)
    assert second not in cell.ids()
    assert record(cell, second).place is Whereabouts.UNSEEN
    assert sum(cell.conveyor.counts.values()) == cell.conveyor.supplied == 6
    (true,) = (true.box for true in cell.conveyor.true_boxes(cell.now) if true.box.id == first)
    assert (true.size_mm, true.weight_kg) == (SIZE, 2.0)
    cell.event(first, BoxEventKind.PICKED)
    returned(cell, first)
    sizes = {item.box.id: item.box.size_mm for item in cell.scan().boxes}
    assert sizes[second] == SIZE
    cell.event(cell.ids()[0], BoxEventKind.PICKED)
    assert {item.box.id: item.box.size_mm for item in cell.scan().boxes}[first] == SIZE
    cell.wait()
    assert sum(cell.conveyor.counts.values()) == cell.conveyor.supplied


@pytest.mark.parametrize('end', ['placed', 'rejected', 'restart'])
def test_a_box_behind_another_is_never_lost_whatever_becomes_of_that(end, tmp_path):
    cell = cell_with(known.TOUCHING, 1, folder=tmp_path)
    first, second = cell.stream[1].id, cell.stream[2].id
    if end == 'restart':
        before = cell.ids()
        cell.ledger.close()
        again = cell_with(known.TOUCHING, 1, folder=tmp_path)
        assert record(again, second).place is Whereabouts.UNSEEN
        assert again.ids() == before
        cell = again
        cell.event(first, BoxEventKind.PICKED)
    elif end == 'placed':
        cell.event(first, BoxEventKind.PLACED)
    else:
        cell.decide(first, reject=True)
    assert record(cell, second).place in (Whereabouts.ON_BELT, Whereabouts.WAITING)
    cell.wait()
    if end == 'restart':
        cell.event(first, BoxEventKind.PLACED)
    places = pack(cell)
    assert sum(places.values()) == 10
    assert set(places) <= {Whereabouts.PLACED, Whereabouts.REJECTED}


def test_a_box_that_the_arm_does_not_find_is_scanned_again_and_rejected_the_second_time():
    cell = cell_with(known.EMPTY_PICK, 0)
    name = cell.stream[0].id
    lies = {true.box.id: true.pose.position[0] for true in cell.conveyor.true_boxes(cell.now)}
    assert abs(lies.pop(name)) > 0.3
    assert set(lies.values()) == {0.0}
    assert not failed_grasp(cell, name).events
    assert (record(cell, name).place, record(cell, name).scans) == (Whereabouts.ON_BELT, 2)
    lies = {true.box.id: true.pose.position[0] for true in cell.conveyor.true_boxes(cell.now)}
    assert lies[name] == 0.0
    for ended in (-1.0, 0.2):  # a goal that was sent before the second scan was seen
        assert failed_grasp(cell, name, ended).events == ()
    assert record(cell, name).place is Whereabouts.ON_BELT
    cell.wait(1.0)
    (event,) = failed_grasp(cell, name).events
    assert (event.reason, event.text) == (Reason.FAULT, 'the arm found no box')
    assert failed_grasp(cell, 'stranger').events == ()


def test_a_box_that_falls_off_the_belt_is_rejected_with_an_event_and_not_lost():
    cell = cell_with(known.FALLEN, 2)
    news = cell.event('b0', BoxEventKind.PICKED)
    (event,) = news.events
    assert (event.box_id, event.event, event.reason, event.text) == (
        'b2',
        BoxEventKind.REJECTED,
        Reason.FAULT,
        'fell off the belt',
    )
    cell.wait()
    cell.event('b0', BoxEventKind.PLACED)
    assert pack(cell) == {Whereabouts.PLACED: 9, Whereabouts.REJECTED: 1}


def test_a_box_that_the_arm_can_take_does_not_fall():
    cell = cell_with(known.FALLEN, 0)
    assert cell.scan().boxes[0].pick_open_s is not None
    cell.event('b1', BoxEventKind.PICKED)
    assert record(cell, 'b0').place is Whereabouts.ON_BELT


def test_what_the_arm_took_just_before_it_was_rejected_is_where_the_arm_put_it():
    cell = ConveyorRig(TEN)
    cell.decide('b0', reject=True)
    cell.event('b0', BoxEventKind.PICKED, stamp=cell.now - 1.0)  # of an earlier journey
    assert record(cell, 'b0').place is Whereabouts.REJECTED
    cell.event('b0', BoxEventKind.PLACED, stamp=cell.now + 0.1)
    assert record(cell, 'b0').place is Whereabouts.PLACED


def test_with_everything_going_wrong_every_box_ends_in_one_place():
    rows = [*(Box(f'b{n}', SIZE, 2.0) for n in range(300))]
    rows[17] = RejectedRow('bad', 'f.csv', 3, 'width_mm', 'x', Reason.INVALID_DATA, 'bad')
    cell = ConveyorRig(rows, faults='all=0.1', seed=3, size_sigma=2.0, weight_sigma=0.02)
    places = pack(cell, 2000)
    assert sum(places.values()) == 300
    assert set(places) == {Whereabouts.PLACED, Whereabouts.REJECTED}
    reasons = Counter(
        record.reason
        for record in cell.conveyor._book._records.values()
        if record.place is Whereabouts.REJECTED
    )
    assert set(reasons) >= {
        Reason.OVERSIZE, Reason.OVERWEIGHT, Reason.DUPLICATE_ID, Reason.NO_READ, Reason.FAULT
    }  # fmt: skip


def test_other_faults_are_another_ledger(tmp_path):
    ConveyorRig(TEN, folder=tmp_path).ledger.close()
    with pytest.raises(Exception, match='another stream'):
        ConveyorRig(TEN, folder=tmp_path, faults='all=0.01')


def test_boxes_inserted_by_hand_have_no_faults():
    cell = ConveyorRig(TEN, faults='fallen=1')
    box = replace(TEN[0], id='by hand')
    cell.conveyor.insert_box(box, *cell.clock())
    assert not cell.conveyor._book.falls(record(cell, 'by hand'))
