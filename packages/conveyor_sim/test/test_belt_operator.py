"""What operators do with the belt, who did it, and jams that somebody must acknowledge."""

from __future__ import annotations

import pytest
from conveyor_rig import ConveyorRig

from conveyor_sim.conveyor.belt_operator import BeltOperator
from conveyor_sim.ledger.ledger import Whereabouts
from pack_msgs_py.codes import BoxEventKind as Kind
from pack_msgs_py.codes import Command, Reason, Severity


class Worked:
    """A conveyor and its operator, anna."""

    def __init__(self, *, itself=False, **parameters):
        self.cell = ConveyorRig(**parameters)
        self.itself = itself
        self.begin()

    def begin(self):
        self.operator = BeltOperator(
            self.cell.conveyor, self.cell.ledger, acknowledges_itself=self.itself
        )
        self.operator.take_up(self.cell.now)

    def do(self, command, why=''):
        done, text, news = self.operator.operate(command, 'anna', why, *self.cell.clock())
        self.news = news
        return done, text

    def step(self, seconds):
        self.cell.step(seconds)
        return self.operator.look(*self.cell.clock())

    @property
    def condition(self):
        return self.cell.conveyor.condition


def test_who_paused_the_belt_and_why_is_said_until_it_goes_on_also_after_a_restart():
    belt = Worked()
    assert belt.do(Command.PAUSE, 'lunch') == (True, 'the belt stands')
    said = belt.operator.said
    assert said.startswith('PAUSED by anna (since ') and said.endswith('): lunch')
    belt.cell.restart()
    belt.begin()
    assert (belt.condition, belt.operator.said) == ('paused', said)
    assert belt.do(Command.RESUME) == (True, 'the belt goes on')
    assert (belt.condition, belt.operator.said) == ('running', '')


def test_what_is_so_already_is_refused_with_who_did_it_and_what_undoes_it():
    belt = Worked()
    belt.do(Command.DRAIN)
    done, text = belt.do(Command.DRAIN)
    assert not done
    assert 'DRAINED by anna (since ' in text and text.endswith('to go on: cell feed')
    assert belt.do(Command.RESUME) == (False, 'the belt is not paused')


def test_what_is_for_the_arm_is_refused():
    assert Worked().do(Command.SWAP_BIN) == (
        False,
        'SWAP_BIN is for the arm executor, not for the conveyor',
    )


def test_emptying_sends_all_but_the_box_of_the_arm_to_the_reject_lane_and_feeds_no_more():
    belt = Worked()
    belt.cell.conveyor.on_handled('b2', *belt.cell.clock())
    assert belt.do(Command.EMPTY) == (
        True,
        "4 boxes went to the reject lane, no more are fed; box 'b2' is with the arm",
    )
    assert {event.reason for event in belt.news.events} == {Reason.OPERATOR}
    assert belt.news.events[0].text == 'belt emptied by anna'
    assert belt.cell.ids() == ['b2']
    belt.cell.event('b2', Kind.PICKED)
    assert (belt.cell.ids(), belt.condition) == ([], 'draining')
    assert belt.operator.said.startswith('DRAINED by anna')
    belt.do(Command.FEED)
    assert belt.cell.ids() == ['b5', 'b6', 'b7', 'b8', 'b9']


def test_emptying_finds_the_box_that_nobody_sees_too():
    belt = Worked(faults='touching=1.0')
    assert belt.cell.conveyor.counts[Whereabouts.UNSEEN] > 0
    belt.do(Command.EMPTY)
    counts = belt.cell.conveyor.counts
    assert sum(counts.values()) == counts[Whereabouts.REJECTED] == belt.cell.scan().supplied


def test_the_belt_stands_while_the_arm_does_and_no_box_goes_round():
    belt = Worked(belt_mode='continuous', max_laps=2)
    belt.cell.step(2.0)
    belt.cell.conveyor.stand_with_arm(True, *belt.cell.clock())
    before = [item.pose for item in belt.cell.scan().boxes]
    belt.cell.step(60.0)
    assert [item.pose for item in belt.cell.scan().boxes] == before
    assert belt.condition == 'standing with the arm'
    belt.cell.conveyor.stand_with_arm(False, *belt.cell.clock())
    belt.cell.step(2.0)
    assert [item.pose for item in belt.cell.scan().boxes] != before


def test_the_box_that_comes_next_can_be_taken_away_once_the_arm_is_paused():
    belt = Worked()
    belt.cell.decide('b1')
    with pytest.raises(ValueError, match='first: cell pause'):
        belt.cell.conveyor.remove_box('b1', *belt.cell.clock())
    belt.cell.conveyor.stand_with_arm(True, *belt.cell.clock())
    assert belt.cell.conveyor.remove_box('b1', *belt.cell.clock()).events


def test_after_a_jam_the_belt_stands_until_somebody_acknowledges_it():
    belt = Worked(jams='at:1+10')
    (alarm,) = belt.step(2.0)
    assert (alarm.code, alarm.severity) == ('JAM', Severity.ALARM)
    assert belt.step(20.0) is None
    assert belt.condition == 'jammed'
    belt.cell.restart()
    belt.begin()
    assert belt.condition == 'jammed' and belt.operator.standing == (alarm,)
    assert belt.do(Command.ACKNOWLEDGE) == (True, 'acknowledged: JAM')
    assert (belt.condition, belt.operator.standing) == ('running', ())
    assert belt.do(Command.ACKNOWLEDGE)[0] is False


def test_when_a_jam_came_and_went_and_who_acknowledged_it_and_why_stays_in_the_ledger():
    belt = Worked(jams='at:1+10,40+10')
    belt.step(2.0)
    begun_s = belt.cell.clock()[1]
    belt.step(20.0)
    over_s = belt.cell.clock()[1]
    belt.step(5.0)
    belt.do(Command.ACKNOWLEDGE, 'carton was stuck')
    belt.step(20.0)
    belt.cell.restart()
    first, second = belt.cell.ledger.alarms()
    assert (first.alarm.code, first.alarm.severity) == ('JAM', Severity.ALARM)
    assert (first.alarm.raised_s, first.ended_s) == pytest.approx((begun_s, over_s))
    assert first.over_s == pytest.approx(over_s + 5.0)
    assert (first.over_by, first.over_why) == ('anna', 'carton was stuck')
    assert (second.ended_s, second.over_s) == (None, None)


def test_a_jam_that_is_acknowledged_before_it_is_over_ends_by_itself():
    belt = Worked(jams='at:1+10')
    belt.step(2.0)
    assert belt.do(Command.ACKNOWLEDGE)[1].endswith('the belt goes on once the jam is over')
    assert belt.step(1.0) is None
    belt.cell.restart()
    belt.begin()
    assert belt.step(1.0) is None
    assert (belt.condition, belt.operator.standing) == ('jammed', ())
    belt.step(10.0)
    assert belt.condition == 'running'
    assert len(belt.cell.ledger.alarms()) == 1


def test_where_nobody_stands_by_a_jam_is_shown_while_it_lasts():
    belt = Worked(jams='at:1+10', itself=True)
    (warning,) = belt.step(2.0)
    assert (warning.code, warning.severity) == ('JAM', Severity.WARNING)
    assert belt.step(10.0) == ()
    assert belt.condition == 'running'
    (kept,) = belt.cell.ledger.alarms()
    assert kept.ended_s is not None and kept.over_s is None


@pytest.mark.parametrize('command', [Command.PAUSE, Command.SWAP_BIN])
def test_every_request_is_in_the_ledger_with_who_when_and_why(command):
    belt = Worked()
    done, text = belt.do(command, 'because')
    (operation,) = belt.cell.ledger.operations()
    assert (operation.command, operation.who, operation.why) == (command.name, 'anna', 'because')
    assert (operation.done, operation.answer) == (done, text)
    assert operation.stamp_s == pytest.approx(belt.cell.clock()[1])
