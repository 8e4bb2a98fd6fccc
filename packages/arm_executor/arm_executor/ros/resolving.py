"""The service by which a person says where a box is that a crash has left in doubt."""

from __future__ import annotations

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future

from arm_executor.goals.core import ExecutorCore
from pack_msgs.srv import ResolveBox


class ResolveService:
    """Serves `~/resolve_box` of ``node`` for the core."""

    def __init__(self, node: Node, core: ExecutorCore) -> None:
        self._core = core
        # It waits for the arm; in the node's own group it would hold up the heartbeat.
        node.create_service(
            ResolveBox, '~/resolve_box', self._resolve, callback_group=ReentrantCallbackGroup()
        )

    async def _resolve(
        self, request: ResolveBox.Request, response: ResolveBox.Response
    ) -> ResolveBox.Response:
        if not request.why.strip():
            response.message = 'say why: what was seen of the box, and where'
            return response
        future = Future()
        text = f'{request.who or "somebody"}: {request.why}'
        self._core.resolve(future, request.box_id, placed=request.placed, text=text)
        response.success, response.message = await future
        return response
