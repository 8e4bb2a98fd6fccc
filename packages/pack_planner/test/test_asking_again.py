"""What is missing is asked for again, ever more seldom, and at once seldom no more when it came."""

from __future__ import annotations

import itertools

from pack_planner.coordination.asking_again import FIRST_S, LONGEST_S, AskingAgain


def asked_at(again: AskingAgain, until_s: int) -> list[int]:
    return [now_s for now_s in range(until_s) if again.due(missing=True, now_s=float(now_s))]


def test_what_is_missing_is_asked_for_again_and_ever_more_seldom():
    times = asked_at(AskingAgain(), 400)
    assert times[:3] == [FIRST_S, 3 * FIRST_S, 7 * FIRST_S]
    assert max(later - before for before, later in itertools.pairwise(times)) == LONGEST_S


def test_what_has_come_is_asked_for_soon_when_it_is_missing_again():
    again = AskingAgain()
    asked_at(again, 400)
    assert not again.due(missing=False, now_s=400.0)
    assert not again.due(missing=True, now_s=401.0)
    assert again.due(missing=True, now_s=401.0 + FIRST_S)
