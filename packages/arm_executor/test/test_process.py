"""The executor as a process: signals, exit codes, and a kill in the middle of a transfer."""

from __future__ import annotations

import signal

import pytest
from executor_bench import ExecutorBench, ExecutorProcess
from executor_cases import make_box, make_decision

from pack_msgs.action import PlaceBox
from pack_msgs.msg import ExecutorState
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.ros.testing import Spinner

pytestmark = pytest.mark.ros


@pytest.fixture
def bench(ros_domain):
    with Spinner() as spinner:
        made = ExecutorBench(spinner.context)
        # Like an action server, a client outlives its node unless told.
        spinner.add(made.node, made.client.destroy)
        yield made


@pytest.fixture
def launch(ros_domain, tmp_path):
    processes = []

    def start(**parameters):
        values = {'arm': 'timed', 'speed': 3.0, 'state_dir': tmp_path / 'state', **parameters}
        processes.append(ExecutorProcess(tmp_path, **values))
        return processes[-1]

    yield start
    for process in processes:
        process.close()


def transfer(bench, box, *, revision=1, corner_mm=(0, 0, 0)):
    """Have ``box`` in the air."""
    bench.feedback.clear()
    bench.show(box, presented=box.id)
    handle = bench.send(bench.goal_msg(make_decision(box, corner_mm, revision=revision)))
    assert handle.accepted
    bench.wait_phase(PlaceBox.Feedback.PHASE_TRANSFERRING)
    bench.wait(lambda: 'PICKED' in bench.events(box.id), 'PICKED')


def test_a_kill_in_transfer_leaves_bins_as_done_and_returns_the_box(launch, bench):
    first, second = make_box(1), make_box(2)
    process = launch()
    bench.ready()
    bench.show(first, presented=first.id)
    assert bench.place(make_decision(first))[1].error_code == ErrorCode.NONE
    transfer(bench, second, revision=2, corner_mm=(300, 0, 0))
    before = bench.bins()
    process.end(signal.SIGKILL)
    bench.heard.clear()
    launch()
    bench.ready()
    bench.wait(lambda: bench.events(second.id) == ['PICKED', 'RETURNED'], 'RETURNED')
    after = bench.bins()
    assert [placed.box for placed in after.bins[0].boxes] == [first]
    assert after.bins[0].boxes == before.bins[0].boxes
    assert after.revision > before.revision
    assert after.bins[0].revision == before.bins[0].revision
    assert bench.events(first.id) == ['PICKED', 'PLACED']
    bench.show(second, presented=second.id)
    again = make_decision(second, (300, 0, 0), revision=2)
    assert bench.place(again)[1].error_code == ErrorCode.NONE


def test_a_kill_after_the_release_leaves_the_box_in_the_bin(launch, bench):
    box = make_box()
    process = launch(speed=2.0)
    bench.ready()
    bench.show(box, presented=box.id)
    bench.send(bench.goal_msg(make_decision(box), deadline_in_s=100.0))
    bench.wait_phase(PlaceBox.Feedback.PHASE_RETREATING)
    process.end(signal.SIGKILL)
    bench.heard.clear()
    launch()
    bench.ready()
    bench.wait(lambda: bench.events(box.id) == ['PICKED', 'PLACED'], 'PLACED')
    assert [placed.box.id for placed in bench.bins().bins[0].boxes] == [box.id]
    assert bench.bins().bins[0].revision == 2


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_with_code_0_even_in_motion(launch, bench, number):
    process = launch()
    bench.ready()
    transfer(bench, make_box())
    code, seconds = process.end(number)
    assert (code, seconds < 3.0) == (0, True), process.text()
    assert 'Traceback' not in process.text()


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_right_after_the_start_ends_it_with_code_0(launch, bench, number):
    process = launch()
    bench.wait(lambda: bench.of('executor_state'), 'heartbeat')
    code, seconds = process.end(number)
    assert (code, seconds < 3.0) == (0, True), process.text()


@pytest.mark.parametrize(
    ('parameters', 'text'),
    [
        ({'bin_type': 'XXL'}, "unknown bin 'XXL'"),
        ({'open_bins': 4}, 'parameter open_bins is 4; it must be at most 3'),
        ({'profile': 'loose'}, 'must be one of paper, cell'),
        ({'sped': 1.0}, "unknown parameter 'sped'"),
    ],
)
def test_a_bad_parameter_ends_it_with_code_2_and_one_line(launch, parameters, text):
    process = launch(**parameters)
    assert process.wait() == 2
    assert text in process.text()
    assert len(process.text().splitlines()) == 1


def test_a_journal_of_another_bin_ends_it_with_code_2(launch, bench):
    process = launch()
    bench.wait_mode(ExecutorState.MODE_IDLE)
    process.end(signal.SIGINT)
    other = launch(bin_type='EQ')
    assert other.wait() == 2
    assert "bin_type is 'LDC' there and 'EQ' here" in other.text()
