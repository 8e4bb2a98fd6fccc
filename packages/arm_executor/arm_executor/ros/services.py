"""The services that the planner calls, and the cut-off; operators have theirs beside these."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future

from arm_executor.bins.book import BookError
from arm_executor.goals.bin_work import BinWork
from arm_executor.goals.candidates import MAX_CANDIDATES
from arm_executor.goals.core import ExecutorCore
from arm_executor.goals.outputs import Checked
from arm_executor.goals.place_goal import PlaceGoal
from arm_executor.model.layout import Layout, pick_pose
from arm_executor.ros.messages import candidate
from pack_msgs.msg import PlacementCheck
from pack_msgs.srv import CheckPlacements, CutOff, SwapBin
from pack_msgs_py.checks import InvalidValue, check_name
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.orientation import at_pick
from pack_msgs_py.ros import conversions


class Services:
    """Answers the services of ``node`` for the core.

    Parameters
    ----------
    node : whose services they are.
    core, bins : what is asked, and what works on the bins.
    layout : says where the pick point is, for candidates.
    orientations : the orientation rule, which says whether boxes are tipped there.
    drain : sends at once what the core has said.
    """

    def __init__(
        self,
        node: Node,
        core: ExecutorCore,
        bins: BinWork,
        layout: Layout,
        orientations: str,
        drain: Callable[[], None],
    ) -> None:
        self._core = core
        self._warn = node.get_logger().warning
        self._layout = layout
        self._orientations = orientations
        self._drain = drain
        self._bins = bins
        node.create_service(SwapBin, 'swap_bin', self._swap_bin)
        node.create_service(CutOff, 'cut_off', self._cut_off)
        # This waits for the arm. In the node's own group, which lets one callback in at a time,
        # it would hold up everything else meanwhile, the heartbeat too.
        waiting = ReentrantCallbackGroup()
        node.create_service(
            CheckPlacements, 'check_placements', self._check, callback_group=waiting
        )

    async def _check(
        self, request: CheckPlacements.Request, response: CheckPlacements.Response
    ) -> CheckPlacements.Response:
        # Those behind are not even converted, which alone would hold up the heartbeat.
        candidates = [self._candidate(msg) for msg in request.candidates[:MAX_CANDIDATES]]
        try:
            enough_s = conversions.duration_from_ros(request.enough, 'enough')
        except InvalidValue as error:
            candidates = [str(error)] * len(candidates)
            enough_s = 0.0
        future = Future()
        goals = [goal for goal in candidates if isinstance(goal, PlaceGoal)]
        self._core.check(future, goals, enough_s)
        answers = iter(await future)
        for goal in candidates:
            if isinstance(goal, PlaceGoal):
                answer = next(answers)
            else:
                answer = Checked(ErrorCode.INVALID_GOAL, goal)
            response.checks.append(
                PlacementCheck(
                    error_code=int(answer.code),
                    error_msg=answer.message,
                    motion_time=conversions.duration_to_ros(answer.motion_s),
                    predicted=answer.predicted,
                )
            )
        more = len(request.candidates) - len(candidates)
        text = f'at most {MAX_CANDIDATES} candidates are looked at in one request'
        busy = PlacementCheck(error_code=int(ErrorCode.BUSY), error_msg=text)
        response.checks = [*response.checks, *[busy] * more]
        return response

    def _candidate(self, msg: Any) -> PlaceGoal | str:  # noqa: ANN401 - pack_msgs/Placement
        """A candidate as goal at the pick point, or what is wrong with it."""
        try:
            decision = conversions.placement_from_ros(msg)
        except ValueError as error:
            return str(error)
        lies = at_pick(decision.orientation, self._orientations)
        pick = pick_pose(self._layout, decision.box.size_mm, lies)
        return candidate(decision, msg.header.frame_id, pick)

    def _swap_bin(self, request: SwapBin.Request, response: SwapBin.Response) -> SwapBin.Response:
        try:
            check_name('destination', request.destination)
            opened = self._core.swap(
                check_name('bin_id', request.bin_id), request.bin_revision, request.destination
            )
        except (BookError, InvalidValue) as error:
            response.message = str(error)
            return response
        response.success = True
        response.new_bin_id, response.new_serial = opened.id, opened.serial
        self._drain()
        return response

    def _cut_off(self, request: CutOff.Request, response: CutOff.Response) -> CutOff.Response:
        try:
            answer = self._bins.cut_off(
                check_name('destination', request.destination),
                check_name('next_destination', request.next_destination),
            )
        except (BookError, InvalidValue) as error:
            response.message = str(error)
        else:
            response.success, response.message = True, str(answer)
            response.closed, response.pending = list(answer.closed), list(answer.pending)
        self._drain()
        return response

    def goal_ended(self) -> None:
        """Bins that are to be closed may now be free."""
        try:
            self._bins.goal_ended()
        except BookError as error:
            self._warn(f'a bin that is to be closed is not closed yet: {error}')
