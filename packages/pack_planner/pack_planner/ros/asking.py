"""Asks the arm about candidates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from rclpy.node import Node

from pack_msgs.msg import PlacementCheck
from pack_msgs.srv import CheckPlacements
from pack_msgs_py.cell_values import Decision
from pack_msgs_py.checks import InvalidValue
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.ros.conversions import duration_from_ros, duration_to_ros, placement_to_ros
from pack_planner.coordination.answers import CheckAnswer

#: Takes the number of a request and the answers, ``None`` when the arm cannot be asked.
Heard = Callable[[int, 'Sequence[CheckAnswer] | None'], None]


class ArmAsker:
    """The client of `check_placements`, one request at a time."""

    def __init__(self, node: Node, heard: Heard) -> None:
        self._client = node.create_client(CheckPlacements, 'check_placements')
        self._heard = heard
        self._warn = node.get_logger().warning
        self._pending: Any = None

    def ask(
        self,
        number: int,
        candidates: Sequence[Decision],
        frames: Mapping[str, str],
        enough_s: float,
    ) -> None:
        """Ask; ``frames`` are those of the bins by id. The one before has been given up by now."""
        if self._pending is not None:
            # nobody else would ever take it off the list when its answer stays away
            self._client.remove_pending_request(self._pending)
            self._pending = None
        if not self._client.service_is_ready():
            self._heard(number, None)
            return
        request = CheckPlacements.Request(
            candidates=[
                placement_to_ros(candidate, frames.get(candidate.bin_id, ''))
                for candidate in candidates
            ],
            enough=duration_to_ros(enough_s),
        )
        self._pending = self._client.call_async(request)
        self._pending.add_done_callback(partial(self._answered, number, len(candidates)))

    def _answered(self, number: int, asked: int, future: Any) -> None:  # noqa: ANN401 - rclpy's
        self._pending = None
        if future.cancelled() or future.result() is None:
            return
        try:
            answers = _answers_from_ros(future.result().checks, asked)
        except ValueError as error:
            self._warn(f'answer of check_placements ignored: {error}', throttle_duration_sec=5.0)
            self._heard(number, None)
        else:
            self._heard(number, answers)


def _answers_from_ros(checks: Sequence[PlacementCheck], asked: int) -> list[CheckAnswer]:
    """The answers about ``asked`` candidates; ``ValueError`` says what is wrong with them."""
    if len(checks) != asked:
        text = f'it holds {len(checks)} answers; {asked} candidates were sent'
        raise InvalidValue(text)
    return [
        CheckAnswer(
            ErrorCode(check.error_code),
            duration_from_ros(check.motion_time, 'motion_time'),
            predicted=check.predicted,
        )
        for check in checks
    ]
