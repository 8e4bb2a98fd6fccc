"""Serves the action `place_box` for the core: every goal ends with a report, whatever came of it.

Every goal is accepted by ROS, since a rejected one could not carry an error code.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from rclpy.task import Future

from arm_executor.goals.admission import Refusal
from arm_executor.goals.core import ExecutorCore
from arm_executor.goals.outputs import Progress
from arm_executor.ros.messages import feedback_to_ros, goal_from_ros, unusable_goal
from pack_msgs.action import PlaceBox
from pack_msgs_py.codes import ErrorCode

#: How long the action server keeps results for a client that asks late. All of them are told on
#: each change of one, which costs a busy client a lot.
RESULT_TIMEOUT_S = 5


class GoalServer:
    """The action server of ``node``.

    Parameters
    ----------
    node : whose action it is.
    core : who has goals done.
    why_not : why a goal of this session of a planner is not taken; empty when it is.
    drain : sends at once what the core has said.
    now_s : seconds since the epoch.
    """

    def __init__(
        self,
        node: Node,
        core: ExecutorCore,
        why_not: Callable[[int], str],
        drain: Callable[[], None],
        now_s: Callable[[], float],
    ) -> None:
        self._core, self._why_not, self._drain, self._now_s = core, why_not, drain, now_s
        self._handles: dict[bytes, ServerGoalHandle] = {}
        self._results: dict[bytes, Future] = {}
        self.action = ActionServer(
            node,
            PlaceBox,
            'place_box',
            self._finish,
            handle_accepted_callback=self._start_goal,
            cancel_callback=self._cancel,
            result_timeout=RESULT_TIMEOUT_S,
        )

    def progress(self, progress: Progress) -> None:
        """Tell how far a goal is."""
        handle = self._handles.get(progress.goal_id)
        if handle is not None:
            handle.publish_feedback(feedback_to_ros(progress))

    def end(self, goal_id: bytes, msg: Any) -> None:  # noqa: ANN401 - pack_msgs/PlacementReport
        """A goal has ended with this report: rclpy goes on with :meth:`_finish` after this."""
        del self._handles[goal_id]
        self._results[goal_id].set_result(
            PlaceBox.Result(error_code=msg.error_code, error_msg=msg.error_msg, report=msg)
        )

    def _start_goal(self, handle: ServerGoalHandle) -> None:
        goal_id = bytes(handle.goal_id.uuid)
        self._handles[goal_id] = handle
        self._results[goal_id] = Future()
        handle.execute()
        try:
            goal = goal_from_ros(handle.request, goal_id, self._now_s())
        except ValueError as error:
            goal = unusable_goal(handle.request, goal_id)
            self._core.refuse(goal, Refusal(ErrorCode.INVALID_GOAL, str(error)))
        else:
            why = self._why_not(handle.request.placement.source.session)
            if why:
                self._core.refuse(goal, Refusal(ErrorCode.NOT_ACTIVE, why))
            else:
                self._core.submit(goal)
        self._drain()

    def _cancel(self, handle: ServerGoalHandle) -> CancelResponse:
        self._core.cancel(bytes(handle.goal_id.uuid))
        return CancelResponse.ACCEPT

    async def _finish(self, handle: ServerGoalHandle) -> PlaceBox.Result:
        """Wait for the report of a goal and end it; its status is EXECUTING meanwhile.

        A callback that blocked here would hold up the heartbeat and every request to cancel.
        """
        goal_id = bytes(handle.goal_id.uuid)
        result: PlaceBox.Result = await self._results[goal_id]
        del self._results[goal_id]
        code = ErrorCode(result.error_code)
        if code.box_is_in_bin:
            handle.succeed()
        elif code is ErrorCode.CANCELED and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        return result
