"""The node as a process: how it starts, ends, dies and comes back."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.ros


class ConveyorProcess:
    def __init__(self, *parameters):
        arguments = [part for parameter in parameters for part in ('-p', parameter)]
        command = [sys.executable, '-m', 'conveyor_sim.ros.node', '--ros-args', *arguments]
        self.popen = subprocess.Popen(
            command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, env=os.environ
        )

    def end(self, number=signal.SIGTERM, timeout=20.0):
        if self.popen.poll() is None:
            self.popen.send_signal(number)
        text = self.popen.communicate(timeout=timeout)[1]
        return self.popen.returncode, text


@pytest.fixture
def process():
    running = []

    def start(*parameters):
        running.append(ConveyorProcess(*parameters))
        return running[-1]

    yield start
    for conveyor in running:
        conveyor.end(signal.SIGKILL)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_it_starts_alone_and_ends_with_code_0_when_told(process, observer, number):
    conveyor = process('speed:=0.0')
    assert len(observer.wait_for(lambda scan: True).boxes) == 5
    start = time.monotonic()
    code, text = conveyor.end(number)
    assert time.monotonic() - start < 3.0
    assert code == 0
    assert 'Traceback' not in text


@pytest.mark.parametrize(
    ('parameter', 'words'),
    [
        ('look_ahead:=0', 'look_ahead is 0'),
        ('boxes_file:=/nowhere.csv', '/nowhere.csv'),
        ('nonsense:=1', 'nonsense'),
        ('arrivals:=often', 'poisson'),
        ('jams:=often', 'random'),
        ('gap:=1.9', 'longer belt_length'),
    ],
)
def test_what_cannot_be_done_ends_with_code_2_and_one_line(process, ros_domain, parameter, words):
    conveyor = process(parameter)
    text = conveyor.popen.communicate(timeout=20.0)[1]
    assert conveyor.popen.returncode == 2
    assert words in text
    assert len(text.strip().splitlines()) == 1


def test_the_ledger_of_another_stream_ends_with_code_2(process, observer, tmp_path):
    first = process(f'state_dir:={tmp_path}')
    observer.wait_for(lambda scan: True)
    assert first.end()[0] == 0
    second = process(f'state_dir:={tmp_path}', 'seed:=4')
    text = second.popen.communicate(timeout=20.0)[1]
    assert second.popen.returncode == 2
    assert 'another stream' in text


def test_after_a_kill_the_same_boxes_come_in_the_same_order(process, observer, tmp_path):
    parameters = ('speed:=0.0', f'state_dir:={tmp_path}', 'seed:=3')
    first = process(*parameters)
    start = observer.wait_for(lambda scan: len(scan.boxes) == 5)
    taken = start.boxes[0].box.id
    observer.send('box_event', observer.picked(taken))
    before = observer.wait_for(lambda scan: scan.supplied == 6)
    assert first.end(signal.SIGKILL)[0] == -signal.SIGKILL
    process(*parameters)
    after = observer.wait_for(lambda scan: scan.sequence > before.sequence + 100)
    assert [item.box for item in after.boxes] == [item.box for item in before.boxes]
    assert (after.supplied, after.remaining) == (6, 34)
