"""What a decision rested on and what was answered, as text: all that it takes to decide it again.

Every number is written with all its digits, so that the same question is asked, not a similar one.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from pack_msgs_py.box_codec import box_from_data, box_to_data
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin
from pack_planner.coordination.alternatives import Planned
from pack_planner.decision.planner import CloseStep, PlaceStep, RejectStep
from pack_planner.decision.policy import DecisionState
from pack_planner.decision.refusals import Forbidden, Refused
from pack_planner.engine import Zone
from pack_planner.parameters import PlannerParameters


@dataclass(frozen=True)
class PlanningQuestion:
    """What was to be decided.

    Attributes
    ----------
    number : counts the questions of one planner process.
    state : boxes, bins and refusals.
    candidates : up to how many placements were asked for.
    parameters : of the planner at that moment.
    """

    number: int
    state: DecisionState
    candidates: int
    parameters: PlannerParameters


@dataclass(frozen=True)
class PlanningRecord:
    """A question and its answer, as :func:`answer_of` tells it; ``planning_s`` is what it took."""

    question: PlanningQuestion
    answer: tuple[str, ...]
    planning_s: float = 0.0


def answer_of(planned: Planned) -> tuple[str, ...]:
    """What came of a decision, a line for each placement, best first, or one for what else it is.

    >>> answer_of(Planned(CloseStep(Bin('LDC-1', 1, parse_bin('LDC')))))
    ('close LDC-1',)
    """
    outcome = planned.outcome
    if isinstance(outcome, PlaceStep):
        return tuple(
            f'{made.box.id} into {made.bin_id} at {made.corner_mm} mm, {made.orientation}'
            for made in planned.candidates()
        )
    if isinstance(outcome, CloseStep):
        return (f'close {outcome.target.id}',)
    if isinstance(outcome, RejectStep):
        return (f'reject {outcome.decision.box.id}: {outcome.decision.reason}',)
    return (f'wait: {outcome.reason}',)


def record_of(question: PlanningQuestion, planned: Planned) -> PlanningRecord:
    """The record of a question that was answered."""
    made = planned.candidates()
    return PlanningRecord(question, answer_of(planned), made[0].planning_s if made else 0.0)


def record_to_json(record: PlanningRecord) -> str:
    """The record on one line; what is no part of a decision is left out."""
    question = record.question
    state, forbidden = question.state, question.state.forbidden
    boxes: dict[str, Any] = {}

    def named(box: Box) -> str:
        """Name of ``box`` in the record: a refused one may have been measured otherwise."""
        data = box_to_data(box)
        del data['extra']
        name, number = box.id, 1
        while boxes.setdefault(name, data) != data:
            name, number = f'{box.id}#{number}', number + 1
        return name

    content = {
        'number': question.number,
        'candidates': question.candidates,
        'parameters': asdict(question.parameters),
        'look_ahead': [named(box) for box in state.boxes],
        'passed_over': state.passed_over,
        'bins': [
            {
                **{name: getattr(target, name) for name in _BIN_FIELDS},
                'kind': target.spec.name,
                'boxes': [
                    [named(p.box), p.corner_mm, p.size_mm, p.orientation, p.measured_mm]
                    for p in target.boxes
                ],
            }
            for target in state.bins
        ],
        'refused': {
            bin_id: [
                [
                    named(r.box), r.zone.orientation, r.zone.corner_mm, r.revision, r.code.name,
                    r.lasting, r.predicted,
                ]
                for r in refused
            ]
            for bin_id, refused in forbidden.by_bin.items()
        },
        'contents': dict(forbidden.contents),
        'thorough': forbidden.thorough,
        'answer': record.answer,
        'planning_s': record.planning_s,
        'boxes': boxes,
    }  # fmt: skip
    return json.dumps(content, separators=(',', ':'))


_BIN_FIELDS = ('id', 'serial', 'station', 'revision', 'destination')


def record_from_json(text: str) -> PlanningRecord:
    """Inverse of :func:`record_to_json`.

    Raises
    ------
    ValueError
        The text is no such record, or that of another version.
    """
    try:
        data = json.loads(text)
        boxes = {name: box_from_data(box) for name, box in data['boxes'].items()}
        bins = tuple(_bin(target, boxes) for target in data['bins'])
        by_bin = {
            bin_id: tuple(_refused(row, boxes) for row in rows)
            for bin_id, rows in data['refused'].items()
        }
        forbidden = Forbidden(by_bin, data['contents'], data['thorough'])
        look_ahead = tuple(boxes[name] for name in data['look_ahead'])
        state = DecisionState(look_ahead, bins, forbidden, tuple(data['passed_over']))
        parameters = _parameters(data['parameters'])
        question = PlanningQuestion(data['number'], state, data['candidates'], parameters)
        return PlanningRecord(question, tuple(data['answer']), float(data['planning_s']))
    except (KeyError, TypeError, AttributeError) as error:
        msg = f'record of a decision cannot be used: {type(error).__name__} {error}'
        raise ValueError(msg) from error


def _bin(data: Mapping[str, Any], boxes: Mapping[str, Box]) -> Bin:
    inside = tuple(
        PlacedBox(
            boxes[name],
            _three(corner),
            _three(size),
            orientation,
            None if measured is None else _three(measured),
        )
        for name, corner, size, orientation, measured in data['boxes']
    )
    named = {name: data[name] for name in _BIN_FIELDS}
    return Bin(spec=parse_bin(data['kind']), boxes=inside, **named)


def _refused(row: list[Any], boxes: Mapping[str, Box]) -> Refused:
    name, orientation, corner, revision, code, lasting, predicted = row
    zone = Zone(orientation, _three(corner))
    return Refused(boxes[name], zone, revision, ErrorCode[code], lasting, predicted)


def _parameters(data: Mapping[str, Any]) -> PlannerParameters:
    known = {field.name for field in fields(PlannerParameters)}
    unknown = set(data) - known
    if unknown:
        msg = f'the planner had parameters that this version lacks: {", ".join(sorted(unknown))}'
        raise ValueError(msg)
    return PlannerParameters(**data)


def _three(values: Any) -> Any:  # noqa: ANN401 - three numbers, whole or not
    x, y, z = values
    return (x, y, z)
