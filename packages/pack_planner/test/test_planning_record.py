"""A question that is written down and read again is the same question, to the last digit."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin
from pack_planner.coordination.alternatives import Planned
from pack_planner.coordination.planning_record import (
    PlanningQuestion,
    PlanningRecord,
    answer_of,
    record_from_json,
    record_of,
    record_to_json,
)
from pack_planner.decision.planner import CloseStep, WaitStep
from pack_planner.decision.policy import DecisionState
from pack_planner.decision.refusals import Forbidden, Refused
from pack_planner.engine import Zone
from pack_planner.parameters import PlannerParameters

EDGE = st.floats(20.0, 800.0)
WHOLE = st.integers(0, 800)
NAME = st.text('ab#1', min_size=1, max_size=3)
boxes = st.builds(
    Box,
    id=NAME,
    size_mm=st.tuples(EDGE, EDGE, EDGE),
    weight_kg=st.floats(0.01, 40.0),
    max_top_load_n=st.none() | st.floats(0.0, 500.0),
    destination=st.sampled_from(['', 'D1']),
    size_stddev_mm=st.tuples(EDGE, EDGE, EDGE),
)
placed = st.builds(
    PlacedBox,
    box=boxes,
    corner_mm=st.tuples(WHOLE, WHOLE, WHOLE),
    size_mm=st.tuples(WHOLE, WHOLE, WHOLE),
    orientation=st.sampled_from(['xyz', 'zyx']),
    measured_mm=st.none() | st.tuples(EDGE, EDGE, EDGE),
)
bins = st.builds(
    Bin,
    id=NAME,
    serial=st.integers(1, 99),
    spec=st.sampled_from([parse_bin('LDC'), parse_bin('RC'), parse_bin('90x80x70:pallet')]),
    boxes=st.lists(placed, max_size=3).map(tuple),
    station=st.sampled_from('ABC'),
    revision=st.integers(0, 99),
    destination=st.sampled_from(['', 'D1']),
)
refused = st.builds(
    Refused,
    box=boxes,
    zone=st.builds(Zone, st.sampled_from(['xyz', 'yxz']), st.tuples(WHOLE, WHOLE, WHOLE)),
    revision=st.integers(0, 99),
    code=st.sampled_from(ErrorCode),
    lasting=st.booleans(),
    predicted=st.booleans(),
)
states = st.builds(
    DecisionState,
    boxes=st.lists(boxes, max_size=4).map(tuple),
    bins=st.lists(bins, max_size=2).map(tuple),
    forbidden=st.builds(
        Forbidden,
        st.dictionaries(NAME, st.lists(refused, min_size=1, max_size=3).map(tuple), max_size=2),
        st.dictionaries(NAME, st.integers(0, 99), max_size=2),
        st.booleans(),
    ),
    passed_over=st.lists(st.integers(0, 9), max_size=4).map(tuple),
)


@given(state=states, candidates=st.integers(1, 64))
def test_a_record_is_read_as_it_was_written(state: DecisionState, candidates: int) -> None:
    parameters = replace(PlannerParameters(), algorithm='dbl', max_passed_over=7)
    question = PlanningQuestion(3, state, candidates, parameters)
    record = PlanningRecord(question, ('a into LDC-1',), 0.25)
    assert record_from_json(record_to_json(record)) == record


def test_each_kind_of_answer_is_told() -> None:
    target = Bin('LDC-1', 1, parse_bin('LDC'))
    question = PlanningQuestion(1, DecisionState((), (target,)), 1, PlannerParameters())
    assert record_of(question, Planned(CloseStep(target))).answer == ('close LDC-1',)
    assert answer_of(Planned(WaitStep('the belt is empty'))) == ('wait: the belt is empty',)


@pytest.mark.parametrize('damage', ['{}', '[1]', 'no json', '{"boxes": {"a": {"id": "a"}}}'])
def test_what_is_no_record_is_refused(damage: str) -> None:
    with pytest.raises(ValueError):
        record_from_json(damage)


def test_parameters_of_another_version_are_named() -> None:
    question = PlanningQuestion(1, DecisionState((), ()), 1, PlannerParameters())
    data = json.loads(record_to_json(PlanningRecord(question, ())))
    data['parameters']['luck'] = 7
    with pytest.raises(ValueError, match='luck'):
        record_from_json(json.dumps(data))
