#!/usr/bin/env python3
"""What the conveyor costs, and how soon its scan is with the planner.

Starts the node `conveyor` with a running belt, which sends `rate` scans a second all the time,
and listens like the planner does. Prints the share of a core that the node used, and the time
from the stamp of a scan to the plain value that the planner decides on.

    ./cell python benchmarks/conveyor_load.py --seconds 30
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rclpy
from rclpy.executors import SingleThreadedExecutor

from pack_cell.running.node_commands import NODES, executable
from pack_msgs.msg import BoxScan
from pack_msgs_py.metrics import quantile
from pack_msgs_py.ros.conversions import scan_from_ros
from pack_msgs_py.ros.qos import TOPICS


def cpu_s(pid: int) -> float:
    """Seconds of processor time that a process and its threads have used."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def measure(seconds: float, rate: float, mode: str, look_ahead: int) -> dict[str, float]:
    """Run it and measure; see the module."""
    delays: list[float] = []

    def on_scan(msg: BoxScan) -> None:
        scan, _ = scan_from_ros(msg)
        delays.append(node.get_clock().now().nanoseconds * 1e-9 - scan.stamp_s)

    rclpy.init()
    node = rclpy.create_node('listener')
    node.create_subscription(BoxScan, 'box_scan', on_scan, TOPICS['box_scan'])
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    with tempfile.TemporaryDirectory() as folder:
        values = {
            'belt_mode': mode,
            'rate': rate,
            'look_ahead': look_ahead,
            'count': 1000,
            'state_dir': folder,
        }
        given = [word for key, value in values.items() for word in ('-p', f'{key}:={value}')]
        program = str(executable(*NODES['conveyor']))
        conveyor = subprocess.Popen(
            [sys.executable, program, '--ros-args', '--log-level', 'warn', *given]
        )
        try:
            while len(delays) < 2 * rate:  # discovery, and the belt filling up
                executor.spin_once(timeout_sec=1.0)
            delays.clear()
            began_s, used_s = time.monotonic(), cpu_s(conveyor.pid)
            while time.monotonic() - began_s < seconds:
                executor.spin_once(timeout_sec=0.1)
            elapsed_s, used_s = time.monotonic() - began_s, cpu_s(conveyor.pid) - used_s
        finally:
            conveyor.terminate()
            conveyor.wait()
            executor.shutdown()
            node.destroy_node()
            rclpy.try_shutdown()
    return {
        'scans per second': len(delays) / elapsed_s,
        'share of a core': used_s / elapsed_s,
        'scan to planner, median ms': 1e3 * quantile(delays, 0.5),
        'scan to planner, 99 % ms': 1e3 * quantile(delays, 0.99),
        'scan to planner, longest ms': 1e3 * max(delays),
    }


def main() -> None:
    """Print one line per figure."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').splitlines()[0])
    parser.add_argument('--seconds', type=float, default=30.0)
    parser.add_argument('--rate', type=float, default=10.0)
    parser.add_argument('--mode', choices=('continuous', 'stop_at_pick'), default='continuous')
    parser.add_argument('--look-ahead', type=int, default=6)
    given = parser.parse_args()
    for name, value in measure(given.seconds, given.rate, given.mode, given.look_ahead).items():
        print(f'{name:30} {value:8.3f}')


if __name__ == '__main__':
    main()
