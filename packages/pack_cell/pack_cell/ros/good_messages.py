"""Good messages and requests of a cell, for somebody who then spoils them."""

from __future__ import annotations

import random
import time
from typing import Any

from rclpy.serialization import deserialize_message

from pack_cell.ros.interfaces_of_node import filled
from pack_msgs.action import PlaceBox
from pack_msgs.msg import (
    AlarmArray,
    BinState,
    BinStateArray,
    BoxEvent,
    BoxScan,
    ExecutorState,
    PlacementDecision,
    PlacementReport,
)
from pack_msgs.srv import CheckPlacements, InsertBox, InsertPlacedBox, Operate, RemoveBox, SwapBin
from pack_msgs_py.alarms import TROUBLES, raised
from pack_msgs_py.cell_values import BinSnapshot, Decision, Report, Scan, ScannedBox
from pack_msgs_py.cell_values import BoxEvent as BoxEventValue
from pack_msgs_py.codes import BinStatus, BoxEventKind, Command, Mode
from pack_msgs_py.geometry.pose import Pose
from pack_msgs_py.ros import conversions as conv
from pack_msgs_py.values import Bin, Box, PlacedBox, parse_bin

_PLACED_AT = Pose((0.155, 0.105, 0.05))


class GoodMessages:
    """Makes them by ``chance``; :attr:`bins` is the last `bin_state` that was heard, serialized."""

    def __init__(self, chance: random.Random) -> None:
        self._chance = chance
        self.bins: bytes | None = None
        self._makers: dict[type, Any] = {
            BoxScan: self._scan,
            BinStateArray: lambda: conv.bins_to_ros(
                BinSnapshot(3, time.time(), (self._bin(),)), self._poses()
            ),
            BinState: lambda: conv.bin_to_ros(
                self._bin(), self._poses(), conv.time_to_ros(time.time()), BinStatus.CLOSED
            ),
            PlacementDecision: lambda: conv.decision_to_ros(self._decision(), 'bin_a'),
            PlacementReport: lambda: conv.report_to_ros(
                Report(self._box().id, measured=Pose(), stamp_s=time.time())
            ),
            BoxEvent: self._event,
            ExecutorState: self._heartbeat,
            AlarmArray: self._alarms,
            InsertBox.Request: lambda: InsertBox.Request(
                box=conv.box_to_ros(self._box(self._chance.randrange(10**6)))
            ),
            InsertPlacedBox.Request: lambda: InsertPlacedBox.Request(
                bin_id=self._decision().bin_id,
                placed=conv.placed_box_to_ros(self._placed(), _PLACED_AT),
            ),
            RemoveBox.Request: lambda: RemoveBox.Request(box_id=self._box().id),
            CheckPlacements.Request: lambda: CheckPlacements.Request(
                candidates=[conv.placement_to_ros(self._decision(), 'bin_a')]
            ),
            SwapBin.Request: lambda: SwapBin.Request(bin_id=self._decision().bin_id),
            Operate.Request: lambda: Operate.Request(
                command=int(self._chance.choice(list(Command))), bin_id=self._decision().bin_id
            ),
            PlaceBox.Impl.SendGoalService.Request: self._goal,
        }

    def of(self, kind: Any) -> Any:  # noqa: ANN401 - any message class, and its message
        """A good message of ``kind``; of one that nothing is known of, one as it is made."""
        make = self._makers.get(kind)
        return filled(kind) if make is None else make()

    def _box(self, number: int | None = None) -> Box:
        number = self._chance.randrange(8) if number is None else number
        return Box(f'hostile-{number}', (300.0, 200.0, 100.0), 2.0)

    def _placed(self) -> PlacedBox:
        return PlacedBox(self._box(99), (0, 0, 0), (310, 210, 100), 'xyz', (155.0, 105.0, 50.0))

    def _bin(self) -> Bin:
        return Bin('LDC-1', 1, parse_bin('LDC'), (self._placed(),), 'A', 3)

    def _poses(self) -> dict[str, Pose]:
        return {self._placed().box.id: _PLACED_AT}

    def _decision(self) -> Decision:
        bin_id, serial, revision = 'LDC-1', 1, 0
        if self.bins is not None:
            state = deserialize_message(self.bins, BinStateArray)
            if state.bins:
                target = state.bins[0]
                bin_id, serial, revision = target.bin_id, target.serial, target.revision
        return Decision(
            self._box(),
            bin_id,
            serial,
            revision,
            size_mm=(310, 210, 101),
            target=_PLACED_AT,
            stamp_s=time.time(),
        )

    def _scan(self) -> BoxScan:
        now_s = time.time()
        boxes = tuple(
            ScannedBox(self._box(n), Pose((0.0, 0.65 + 0.8 * n, 0.8)), now_s if n == 0 else None)
            for n in range(5)
        )
        return conv.scan_to_ros(Scan(int(now_s), now_s, boxes, supplied=5, remaining=9))

    def _event(self) -> BoxEvent:
        kind = self._chance.choice(list(BoxEventKind))
        return conv.event_to_ros(BoxEventValue(self._box().id, kind, stamp_s=time.time()))

    def _alarms(self) -> AlarmArray:
        node = self._chance.choice(('/conveyor', '/arm_executor', '/stranger'))
        code = self._chance.choice(list(TROUBLES))
        alarm = raised(code, 'said by nobody', time.time(), box_id=self._box().id)
        standing = (alarm,) if alarm is not None and self._chance.random() < 0.7 else ()
        return conv.alarms_to_ros(node, standing, time.time())

    @staticmethod
    def _heartbeat() -> ExecutorState:
        state = ExecutorState(mode=int(Mode.IDLE))
        state.header.stamp = conv.time_to_ros(time.time())
        return state

    def _goal(self) -> Any:  # noqa: ANN401 - of a class that rclpy makes
        goal = PlaceBox.Goal(placement=conv.placement_to_ros(self._decision(), 'bin_a'))
        goal.pick_pose.header.frame_id = 'cell'
        goal.pick_pose.pose = conv.pose_to_ros(Pose((0.0, 0.65, 0.8)))
        goal.deadline = conv.time_to_ros(time.time() + 60.0)
        request = PlaceBox.Impl.SendGoalService.Request(goal=goal)
        request.goal_id.uuid = list(self._chance.randbytes(16))
        return request
