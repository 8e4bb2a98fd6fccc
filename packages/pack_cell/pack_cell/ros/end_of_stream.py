"""Program `end_of_stream`: ends when every box of the stream is accounted for, for launch files.

It listens to what the recorder of a run listens to, and says nothing itself.
"""

from __future__ import annotations

import rclpy
from rclpy.context import Context

from pack_cell.report.record import RunRecord
from pack_cell.ros.recorder import Recorder
from pack_msgs_py.ros.run_node import run_node

LOOK_PERIOD_S = 0.5


class StreamEnded(Exception):
    """Every box is where it ends."""


class EndOfStream(Recorder):
    """Raises :class:`StreamEnded` from its timer once the record is complete."""

    def __init__(self, context: Context | None = None) -> None:
        super().__init__(RunRecord(), context=context, name='end_of_stream')
        self.create_timer(LOOK_PERIOD_S, self._look)

    def _look(self) -> None:
        if self.record.complete() and self.record.all_reported():
            self.get_logger().info('every box of the stream is accounted for')
            raise StreamEnded


def main(args: list[str] | None = None) -> None:
    """Run until the stream has ended, or a signal."""
    try:
        run_node('end_of_stream', EndOfStream, args=args)
    except StreamEnded:
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
