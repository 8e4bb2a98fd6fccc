"""Node `topic_recorder`: writes every topic into a file, and keeps the last seconds of a fault.

Subscribes
    every topic of its namespace, and of no namespace, as it comes up; hidden ones left out

It may be killed at any time: it sends nothing, and nobody waits for it. SIGUSR1 tells it that a
node has died, SIGUSR2 that nothing happens any more: both are faults.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rclpy.signals import SignalHandlerOptions

from pack_cell.recording.faults import (
    FaultFolders,
    fault_of_event,
    fault_of_mode,
    fault_of_report,
)
from pack_cell.recording.flight import FlightBuffer
from pack_cell.recording.mcap_file import McapFile
from pack_cell.recording.messages import RecordedMessage, RecordedTopic
from pack_cell.recording.parameters import RecorderParameters
from pack_cell.ros.message_definitions import message_class, message_definition
from pack_cell.ros.topic_offers import offer_of, request_for
from pack_msgs.msg import AlarmArray, BoxEvent, ExecutorState, PlacementReport
from pack_msgs_py.codes import Mode, Severity
from pack_msgs_py.ros import conversions
from pack_msgs_py.ros.declare_parameters import declare_parameters
from pack_msgs_py.ros.parameter_service import check_parameters_of_nodes

#: How often new topics are looked for, at first and later.
LOOK_PERIOD_S, LOOK_SELDOM_S, LOOKS_OFTEN = 0.2, 1.0, 50
#: A fault is kept so much later, with what was said after it.
AFTERMATH_S = 1.0
#: The topic that tells robot time is recorded as what ROS takes time from.
ROBOT_TIME, CLOCK = 'robot_time', '/clock'
#: Codes of what `cell run` notices, by the signal that tells of it.
_FAULT_SIGNALS = {signal.SIGUSR1: 'NODE_DIED', signal.SIGUSR2: 'STALLED'}
#: After a signal to stop, the recorder goes on until it has heard nothing for so long.
QUIET_S, LAST_WORDS_S = 0.1, 2.0
#: The recorder gives way to what moves the cell.
NICENESS = 5


class TopicRecorder(Node):
    """See the module."""

    def __init__(self, **node_options: Any) -> None:  # noqa: ANN401 - rclpy's own options
        """``node_options`` go to :class:`rclpy.node.Node`."""
        super().__init__('topic_recorder', **node_options)
        self._parameters = given = declare_parameters(self, RecorderParameters)
        self._file = McapFile(Path(given.file), given.chunk_s) if given.file else None
        self._faults = FaultFolders(Path(given.state_dir)) if given.state_dir else None
        self._flight = FlightBuffer(given.keep_s)
        self._topics: dict[str, RecordedTopic | None] = {}
        self._readers: dict[str, Callable[[bytes], tuple[str, ...]]] = {
            'pack_msgs/msg/PlacementReport': _fault_in_report,
            'pack_msgs/msg/BoxEvent': _fault_in_event,
            'pack_msgs/msg/ExecutorState': self._fault_in_state,
            'pack_msgs/msg/AlarmArray': self._faults_in_alarms,
            'diagnostic_msgs/msg/DiagnosticArray': self._note_diagnostics,
        }
        self._nodes: dict[str, Any] = {}
        self._alarms: dict[str, frozenset[str]] = {}
        self._mode = Mode.INACTIVE
        self._due: dict[str, float] = {}
        self.heard = 0
        self._looks = 0
        self._timer = self.create_timer(LOOK_PERIOD_S, self._tick)

    def note(self, code: str) -> None:
        """There is a fault: what was said before it is to be kept."""
        now_s = time.monotonic()
        if self._faults is not None and self._faults.is_due(code, now_s):
            self._due[code] = now_s + AFTERMATH_S

    def close(self) -> None:
        """Keep the faults that are due, and end the file."""
        self._keep_due(everything=True)
        file, self._file = self._file, None
        if file is not None:
            try:
                file.close()
            except OSError as error:
                self._tell(f'{self._parameters.file} has no end: {error}')

    # -- topics ---------------------------------------------------------------------------------

    def _tick(self) -> None:
        self._looks += 1
        if self._looks == LOOKS_OFTEN:
            self._timer.timer_period_ns = round(1e9 * LOOK_SELDOM_S)
        for name, types in self.get_topic_names_and_types():
            if name not in self._topics and self._is_ours(name):
                self._listen(name, types)
        if self._file is not None:
            self._write(partial(self._file.end_chunk, time.time_ns()))
        self._keep_due()

    def _is_ours(self, name: str) -> bool:
        hidden = any(part.startswith('_') for part in name.split('/'))
        home = self.get_namespace().rstrip('/') + '/'
        return not hidden and (name.startswith(home) or name.count('/') == 1)

    def _listen(self, name: str, types: list[str]) -> None:
        publishers = self.get_publishers_info_by_topic(name)
        if not publishers:
            return
        type_name = types[0]
        try:
            kind = message_class(type_name)
        except LookupError as error:
            self._topics[name] = None
            self.get_logger().warning(f'{name} is not recorded: {error}')
            return
        recorded_as = CLOCK if name.rsplit('/', 1)[1] == ROBOT_TIME else name
        self._topics[name] = topic = RecordedTopic(
            recorded_as,
            type_name,
            message_definition(type_name),
            tuple(offer_of(publisher) for publisher in publishers),
            str(publishers[0].topic_type_hash),
        )

        # Two arguments: rclpy tells by their number whether it is to say when a message was sent.
        def hear(data: bytes, info: dict[str, int]) -> None:
            self._hear(topic, data, info)

        self.create_subscription(kind, name, hear, request_for(publishers), raw=True)

    def _hear(self, topic: RecordedTopic, data: bytes, info: dict[str, int]) -> None:
        self.heard += 1
        heard_ns = info.get('received_timestamp') or time.time_ns()
        message = RecordedMessage(topic, heard_ns, info.get('source_timestamp') or heard_ns, data)
        if self._file is not None:
            self._write(partial(self._file.add, message))
        if self._faults is not None:
            self._flight.add(message)
            for code in self._faults_in(topic.type_name, data):
                self.note(code)

    def _write(self, write: Callable[[], None]) -> None:
        """Write to the file; one that cannot be written to ends, and the cell goes on."""
        try:
            write()
        except OSError as error:
            self._file = None
            text = f'{self._parameters.file} ends here: {error}; the cell goes on unrecorded'
            self.get_logger().error(text)

    # -- faults ---------------------------------------------------------------------------------

    def _keep_due(self, *, everything: bool = False) -> None:
        now_s = time.monotonic()
        for code, due_s in list(self._due.items()):
            if self._faults is None or (due_s > now_s and not everything):
                continue
            del self._due[code]
            try:
                folder = self._faults.keep(code, self._flight.content(), self._nodes)
            except OSError as error:
                self._tell(f'{code} was not kept: {error}')
            else:
                self._tell(f'{code}: the last {self._parameters.keep_s:g} s are in {folder}')

    def _tell(self, text: str) -> None:
        # At the end the logger has nobody to publish to any more.
        print(f'topic_recorder: {text}', flush=True)

    def _faults_in(self, type_name: str, data: bytes) -> list[str]:
        """Codes of the faults that a message tells of."""
        read = self._readers.get(type_name)
        try:
            return [] if read is None else [code for code in read(data) if code]
        except ValueError:
            return []

    def _faults_in_alarms(self, data: bytes) -> tuple[str, ...]:
        node, alarms = conversions.alarms_from_ros(deserialize_message(data, AlarmArray))
        codes = frozenset(each.code for each in alarms if each.severity is Severity.ALARM)
        before, self._alarms[node] = self._alarms.get(node, frozenset()), codes
        return tuple(codes - before)

    def _fault_in_state(self, data: bytes) -> tuple[str, ...]:
        msg = deserialize_message(data, ExecutorState)
        before, self._mode = self._mode, Mode(msg.mode)
        self._nodes['executor_state'] = {
            'mode': self._mode.name,
            'active_box_id': msg.active_box_id,
            'message': msg.message,
        }
        return (fault_of_mode(self._mode),) if self._mode is not before else ()

    def _note_diagnostics(self, data: bytes) -> tuple[str, ...]:
        for status in deserialize_message(data, DiagnosticArray).status:
            self._nodes[status.name] = {
                'level': int.from_bytes(status.level, 'little'),
                'message': status.message,
                **{value.key: value.value for value in status.values},
            }
        return ()


def _fault_in_report(data: bytes) -> tuple[str, ...]:
    report = conversions.report_from_ros(deserialize_message(data, PlacementReport))
    return (fault_of_report(report),)


def _fault_in_event(data: bytes) -> tuple[str, ...]:
    event = conversions.event_from_ros(deserialize_message(data, BoxEvent))
    return (fault_of_event(event),)


class Signals:
    """What the process was told by signals since the last look; made in the main thread."""

    def __init__(self) -> None:
        self.stop = False
        self.faults: list[str] = []
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            signal.signal(number, self._on_stop)
        for number in _FAULT_SIGNALS:
            signal.signal(number, self._on_fault)

    def _on_stop(self, number: int, frame: FrameType | None) -> None:
        self.stop = True

    def _on_fault(self, number: int, frame: FrameType | None) -> None:
        self.faults.append(_FAULT_SIGNALS[signal.Signals(number)])


def record(recorder: TopicRecorder, signals: Signals) -> None:
    """Listen until a signal says to stop, and then to what has been said until then."""
    executor = SingleThreadedExecutor(context=recorder.context)
    executor.add_node(recorder)
    while not signals.stop:
        executor.spin_once(timeout_sec=LOOK_PERIOD_S)
        while signals.faults:
            recorder.note(signals.faults.pop())
    # Both signals may have come at once.
    for code in signals.faults:
        recorder.note(code)
    until_s = time.monotonic() + LAST_WORDS_S
    heard = -1
    while heard != recorder.heard and time.monotonic() < until_s:
        heard, pause_s = recorder.heard, time.monotonic() + QUIET_S
        while time.monotonic() < pause_s:
            executor.spin_once(timeout_sec=QUIET_S)
    executor.shutdown(timeout_sec=0.0)


def main(args: list[str] | None = None) -> None:
    """Record until a signal; code 2 for parameters or a file that cannot be used."""
    os.nice(NICENESS)
    signals = Signals()
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    check_parameters_of_nodes()
    try:
        recorder = TopicRecorder()
    except (ValueError, OSError) as error:
        get_logger('topic_recorder').fatal(str(error))
        rclpy.try_shutdown()
        sys.exit(2)
    try:
        record(recorder, signals)
    finally:
        recorder.close()
        recorder.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
