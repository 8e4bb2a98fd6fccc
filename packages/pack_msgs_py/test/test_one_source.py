"""Each stream has one source: a node that starts again is believed, a second one is named."""

from __future__ import annotations

from pack_msgs_py.one_source import CLOCKS_DIFFER_S, SECOND_SILENT_S, OneSource

FIRST = 1_700_000_000 * 10**9
SECOND, THIRD = FIRST + 5 * 10**9, FIRST + 9 * 10**9
EPOCH_S = 1e-9 * THIRD


class Listener:
    """Hears what is said for the arm, which speaks every 100 ms, and notes what was taken."""

    def __init__(self, silent_s: float = 1.1, *, since: int = 0) -> None:
        self.source = OneSource('the arm', silent_s, since=since)
        self.taken: list[tuple[int, int]] = []
        self.now_s = 100.0

    def hear(self, session: int, number: int, *, topic: str = 'state', after_s: float = 0.1) -> str:
        self.now_s += after_s
        said = (session, number)
        return self.source.hear(
            topic, said, lambda: self.taken.append(said), now_s=self.now_s, epoch_s=EPOCH_S
        )

    @property
    def second(self) -> str:
        return self.source.second(self.now_s)


def test_all_that_one_node_says_is_taken():
    arm = Listener()
    assert [arm.hear(FIRST, number) for number in (1, 2, 5)] == ['', '', '']
    assert [number for _, number in arm.taken] == [1, 2, 5]
    assert not arm.second


def test_what_is_played_again_is_left_out_on_its_topic_alone():
    arm = Listener()
    arm.hear(FIRST, 7)
    assert 'message 7 of the arm on state was heard before' in arm.hear(FIRST, 7)
    assert 'heard before' in arm.hear(FIRST, 3)
    assert arm.hear(FIRST, 3, topic='events') == ''
    assert arm.taken == [(FIRST, 7), (FIRST, 3)]


def test_a_topic_that_is_subscribed_to_anew_may_be_heard_again():
    arm = Listener()
    arm.hear(FIRST, 7)
    arm.source.heard_again('state')
    assert arm.hear(FIRST, 7) == ''


def test_a_node_that_starts_again_is_believed_and_nothing_that_it_said_is_lost():
    arm = Listener()
    arm.hear(FIRST, 50)
    assert arm.hear(SECOND, 1, after_s=0.8, topic='events') == ''
    assert arm.taken == [(FIRST, 50)]
    arm.hear(SECOND, 1, after_s=0.4)
    assert arm.taken == [(FIRST, 50), (SECOND, 1), (SECOND, 1)]
    assert not arm.second


def test_what_a_node_says_once_after_its_start_is_taken_though_it_falls_silent():
    arm = Listener()
    arm.hear(FIRST, 50)
    arm.hear(SECOND, 1, after_s=0.8, topic='events')
    arm.source.settle(arm.now_s + 0.2)
    assert arm.taken == [(FIRST, 50)], 'the first may still live'
    arm.source.settle(arm.now_s + 0.4)
    assert arm.taken == [(FIRST, 50), (SECOND, 1)]
    assert arm.hear(SECOND, 2, after_s=9.0, topic='events') == ''


def test_a_last_word_that_was_under_way_is_no_second_source():
    arm = Listener()
    arm.hear(FIRST, 50)
    arm.hear(SECOND, 1)
    arm.hear(FIRST, 51, after_s=0.05)
    arm.hear(SECOND, 2, after_s=1.2)
    assert arm.taken[-1] == (SECOND, 2)
    assert not arm.second


def test_two_that_speak_at_a_time_are_named_and_the_first_is_believed():
    arm = Listener()
    for number in range(1, 11):
        arm.hear(FIRST, number, after_s=0.05)
        arm.hear(SECOND, number, after_s=0.05)
    assert {session for session, _ in arm.taken} == {FIRST}
    assert 'a second source speaks for the arm on state' in arm.second


def test_a_second_one_that_has_gone_is_forgotten():
    arm = Listener()
    arm.hear(SECOND, 1)
    arm.hear(FIRST, 1)
    assert arm.second
    arm.hear(SECOND, 2, after_s=SECOND_SILENT_S + 0.1)
    assert not arm.second


def test_when_the_first_dies_while_two_speak_the_second_is_believed():
    arm = Listener()
    for number in range(1, 11):
        arm.hear(FIRST, number, after_s=0.05)
        arm.hear(SECOND, number, after_s=0.05)
    for number in range(11, 30):
        arm.hear(SECOND, number)
    assert arm.taken[-1] == (SECOND, 29)


def test_an_old_recording_is_left_out_whether_or_not_the_node_speaks():
    arm = Listener()
    arm.hear(SECOND, 1)
    assert 'second source' in arm.hear(FIRST, 900, after_s=60.0)
    assert 'second source' in arm.hear(0, 0, after_s=60.0)
    assert arm.taken == [(SECOND, 1)]


def test_a_session_that_has_not_begun_is_left_out():
    arm = Listener()
    session = THIRD + round(1e9 * (CLOCKS_DIFFER_S + 40))
    assert 'starts in 100 s' in arm.hear(session, 1)
    assert arm.taken == []


def test_a_number_that_nobody_can_have_reached_does_not_silence_the_source():
    arm = Listener()
    assert 'second source' in arm.hear(FIRST, 2**64 - 1)
    arm.hear(FIRST, 7)
    assert 'sends message 18446744073709551615 after 7' in arm.hear(FIRST, 2**64 - 1)
    arm.hear(FIRST, 8)
    assert [number for _, number in arm.taken] == [7, 8]
    assert arm.second


def test_a_node_of_ones_own_need_not_say_who_it_is():
    arm = Listener()
    assert arm.hear(0, 0) == arm.hear(0, 0) == ''
    assert len(arm.taken) == 2


def test_where_all_say_who_they_are_a_stranger_is_not_believed_though_he_speaks_first():
    arm = Listener(since=FIRST)
    assert 'does not say when it started, none is believed yet' in arm.hear(0, 0)
    assert arm.hear(FIRST, 1) == ''
    assert arm.taken == [(FIRST, 1)]


def test_a_recording_that_is_retained_is_not_believed_by_the_run_after_it():
    arm = Listener(since=SECOND)
    assert 'second source' in arm.hear(FIRST, 3)
    assert arm.second
    assert arm.hear(SECOND, 1) == ''
    assert arm.taken == [(SECOND, 1)]


def test_a_start_before_there_were_such_cells_is_not_believed():
    arm = Listener()
    assert 'second source' in arm.hear(2, 1)
    assert arm.taken == []


def test_of_nodes_that_seldom_speak_the_newest_is_believed_at_once():
    planner = Listener(silent_s=0.0)
    planner.hear(FIRST, 3)
    planner.hear(SECOND, 1)
    assert planner.taken == [(FIRST, 3), (SECOND, 1)]
    assert 'second source' in planner.hear(FIRST, 4)
    assert planner.second


def test_the_first_of_two_is_believed_again_when_the_second_has_gone():
    planner = Listener(silent_s=0.0)
    planner.hear(FIRST, 3)
    planner.hear(SECOND, 1)
    assert 'second source' in planner.hear(FIRST, 4, after_s=1.0)
    assert 'second source' in planner.hear(FIRST, 3, after_s=SECOND_SILENT_S), 'played again'
    assert planner.hear(FIRST, 5, after_s=0.1) == ''
    assert planner.taken[-1] == (FIRST, 5)
    assert not planner.second
