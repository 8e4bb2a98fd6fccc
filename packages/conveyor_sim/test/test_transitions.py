"""Events that come twice, late or out of order leave a box where it is."""

from __future__ import annotations

from itertools import permutations

import pytest

from conveyor_sim.ledger.ledger import BoxRecord, Whereabouts
from conveyor_sim.ledger.transitions import next_place
from pack_msgs_py.codes import BoxEventKind as Kind

JOURNEY = [
    (Kind.PICKED, 10),
    (Kind.RETURNED, 20),
    (Kind.PICKED, 30),
    (Kind.PLACED, 40),
]


def after(events, record=None):
    record = record or BoxRecord(0, 'a', Whereabouts.ON_BELT)
    for kind, stamp in events:
        place = next_place(record, kind, stamp)
        if place is not None:
            back = record.returned or place is Whereabouts.ON_BELT
            record = BoxRecord(0, 'a', place, stamp_ns=stamp, returned=back)
    return record.place


def test_a_journey_ends_in_the_bin():
    assert after(JOURNEY) is Whereabouts.PLACED


@pytest.mark.parametrize('step', range(1, 5))
def test_any_copy_of_an_earlier_event_changes_nothing(step):
    so_far = JOURNEY[:step]
    for copies in permutations(so_far):
        assert after([*so_far, *copies]) is after(so_far)


def test_a_late_copy_of_picked_does_not_take_a_returned_box():
    assert after([(Kind.PICKED, 10), (Kind.RETURNED, 20), (Kind.PICKED, 10)]) is Whereabouts.ON_BELT


def test_a_clock_that_was_set_back_does_not_stop_a_box():
    assert after([(Kind.PICKED, 10), (Kind.PLACED, 5)]) is Whereabouts.PLACED


def test_a_missed_picked_is_made_up_by_placed():
    assert after([(Kind.PLACED, 10), (Kind.PICKED, 9), (Kind.PICKED, 11)]) is Whereabouts.PLACED


def test_a_lost_box_can_be_found_and_a_rejected_one_is_gone():
    assert after([(Kind.LOST, 10), (Kind.RETURNED, 20)]) is Whereabouts.ON_BELT
    assert after([(Kind.PICKED, 5), (Kind.LOST, 10), (Kind.PICKED, 5)]) is Whereabouts.LOST
    for kind in Kind:
        assert after([(Kind.REJECTED, 10), (kind, 5)]) is Whereabouts.REJECTED
        if kind not in (Kind.PICKED, Kind.PLACED):
            assert after([(Kind.REJECTED, 10), (kind, 20)]) is Whereabouts.REJECTED


def test_the_arm_may_have_been_quicker_than_the_reject_lane():
    assert after([(Kind.REJECTED, 10), (Kind.PICKED, 20)]) is Whereabouts.PICKED
    assert after([(Kind.REJECTED, 10), (Kind.PLACED, 20)]) is Whereabouts.PLACED


def test_unknown_moves_nothing():
    assert after([(Kind.UNKNOWN, 10)]) is Whereabouts.ON_BELT
