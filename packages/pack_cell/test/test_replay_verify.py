"""A decision made again is the same; one that is not is told."""

from __future__ import annotations

import time
from dataclasses import replace

from pack_cell.replay.verify import decide_again
from pack_msgs_py.values import Bin, Box, parse_bin
from pack_planner.coordination.alternatives import planned, quick
from pack_planner.coordination.planning_record import (
    PlanningQuestion,
    PlanningRecord,
    record_from_json,
    record_of,
    record_to_json,
)
from pack_planner.decision.planner import PlaceStep, Planner, expected_bins
from pack_planner.decision.policy import DecisionState
from pack_planner.parameters import PlannerParameters, settings

PARAMETERS = replace(PlannerParameters(), algorithm='dbl')


def decided(boxes: int, candidates: int = 3) -> list[PlanningRecord]:
    """The records of a stream of boxes that are placed one after another."""
    wanted = settings(PARAMETERS)
    planner = Planner(wanted, time.perf_counter)
    follower = Planner(quick(wanted), time.perf_counter)
    bins: tuple[Bin, ...] = (Bin('LDC-1', 1, parse_bin('LDC')),)
    waiting = [Box(f'b{n}', (300.0 + 10 * n, 200.0, 150.0), 2.0) for n in range(boxes + 2)]
    records = []
    for number in range(boxes):
        state = DecisionState(tuple(waiting[:3]), bins)
        made = planned(planner.decide, follower.decide, state, candidates)
        question = PlanningQuestion(number, state, candidates, PARAMETERS)
        text = record_to_json(record_of(question, made))
        records.append(record_from_json(text))
        assert isinstance(made.outcome, PlaceStep)
        bins = expected_bins(bins, made.outcome.decision)
        waiting = [box for box in waiting if box != made.outcome.decision.box]
    return records


def test_what_was_recorded_comes_out_again() -> None:
    records = decided(6)
    assert all(again.same for again in decide_again(records))
    assert len(records[0].answer) == 3


def test_another_answer_is_told_with_both() -> None:
    [record, other] = decided(2)
    swapped = replace(record, answer=other.answer)
    [again] = decide_again([swapped])
    assert not again.same and not again.time_limited
    assert other.answer[0] in again.text and record.answer[0] in again.text


def test_another_alternative_is_told_apart_from_another_choice() -> None:
    [record] = decided(1)
    [again] = decide_again([replace(record, answer=record.answer[:1])])
    assert not again.same
    assert 'alternatives' in again.text


def test_a_search_that_used_up_its_budget_is_said_to_be_limited_by_time() -> None:
    [record] = decided(1)
    slow = replace(record, planning_s=PARAMETERS.budget_s, answer=('something else',))
    [again] = decide_again([slow])
    assert again.time_limited and 'limited by time' in again.text
