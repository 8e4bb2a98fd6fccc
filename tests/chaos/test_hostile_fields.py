"""Whatever stands in any field of a message, its conversion says what is wrong, or gives a value
that the rest of the cell can count with."""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest

pytest.importorskip('rclpy')

from hypothesis import given, settings
from hypothesis import strategies as st

from arm_executor.ros.messages import goal_from_ros, unusable_goal
from pack_cell.hostile_fields import choices, fields_of, put
from pack_msgs.action import PlaceBox
from pack_msgs_py.cell_values import BinSnapshot, BoxEvent, Decision, Report, Scan, ScannedBox
from pack_msgs_py.checks import LARGEST_COUNT, LONGEST_TEXT
from pack_msgs_py.closing import Cause, ClosingReason
from pack_msgs_py.codes import BoxEventKind, ErrorCode
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.ros import conversions as conv
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin

BOX = Box('carton', (300.0, 200.0, 100.0), 2.0)
PLACED = PlacedBox(BOX, (0, 0, 0), (300, 200, 100), 'xyz', (150.0, 100.0, 50.0))
TARGET = Pose((0.15, 0.1, 0.05))
BINS = BinSnapshot(3, 50.0, (Bin('LDC-1', 1, parse_bin('LDC'), (PLACED,), 'A', 3),))
DECISION = Decision(BOX, 'LDC-1', 1, 3, size_mm=(300, 200, 100), target=TARGET)
REASON = ClosingReason('LDC-1', {Cause.TOO_HIGH: 2}, 3, {ErrorCode.NO_IK_SOLUTION: 1}, 6.5)
NOW_S = 1000.0


def goal() -> PlaceBox.Goal:
    return PlaceBox.Goal(placement=conv.placement_to_ros(DECISION, 'bin_a'))


#: A good message of each kind, and what makes a value of it.
KINDS: dict[str, tuple[Any, Callable[[Any], Any]]] = {
    'box_scan': (conv.scan_to_ros(Scan(1, 50.0, (ScannedBox(BOX, Pose()),))), conv.scan_from_ros),
    'bin_state': (conv.bins_to_ros(BINS, {BOX.id: TARGET}), conv.bins_from_ros),
    'placements': (conv.decision_to_ros(DECISION), conv.decision_from_ros),
    'placement_report': (
        conv.report_to_ros(Report(BOX.id, measured=Pose())),
        conv.report_from_ros,
    ),
    'box_event': (
        conv.event_to_ros(BoxEvent(BOX.id, BoxEventKind.PICKED)),
        conv.event_from_ros,
    ),
    'bin_closing': (conv.closing_to_ros(REASON), conv.closing_from_ros),
    'place_box': (goal(), lambda msg: goal_from_ros(msg, bytes(16), NOW_S)),
    'refused goal': (goal(), lambda msg: unusable_goal(msg, bytes(16))),
}


def numbers_and_texts(value: Any) -> Iterator[Any]:
    """All that a value consists of."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from numbers_and_texts(getattr(value, field.name))
    elif isinstance(value, dict):
        yield from numbers_and_texts([*value, *value.values()])
    elif isinstance(value, (tuple, list)):
        for item in value:
            yield from numbers_and_texts(item)
    else:
        yield value


def assert_usable(value: Any, kind: str) -> None:
    for part in numbers_and_texts(value):
        if isinstance(part, float) and kind != 'refused goal':
            assert math.isfinite(part) and abs(part) <= 1e13
        elif isinstance(part, int):
            assert -LARGEST_COUNT - 1 <= part <= LARGEST_COUNT
        elif isinstance(part, str):
            assert len(part) <= LONGEST_TEXT + 3 and part.isprintable()


@pytest.mark.parametrize('kind', KINDS)
@settings(deadline=None)
@given(data=st.data())
def test_a_conversion_refuses_or_gives_what_can_be_counted_with(kind: str, data: Any) -> None:
    good, convert = KINDS[kind]
    msg = copy.deepcopy(good)
    for _ in range(data.draw(st.integers(1, 3))):
        path, field = data.draw(st.sampled_from(list(fields_of(msg))))
        put(msg, path, data.draw(st.sampled_from(choices(msg, path, field))))
    try:
        value = convert(msg)
    except ValueError as error:
        assert 0 < len(str(error)) < 2000
        return
    assert_usable(value[0] if kind == 'box_scan' else value, kind)


@pytest.mark.parametrize('kind', [kind for kind in KINDS if kind != 'refused goal'])
def test_each_single_huge_number_is_refused_with_the_value(kind: str) -> None:
    good, convert = KINDS[kind]
    for path, field in fields_of(good):
        if field != 'double':
            continue
        msg = copy.deepcopy(good)
        put(msg, path, 1e300)
        try:
            errors = convert(msg)[1] if kind == 'box_scan' else convert(msg)
        except ValueError as error:
            errors = [str(error)]
        # 1e+300 m, or 1e+303 mm
        assert errors and any('e+30' in text for text in errors), (path, errors)
