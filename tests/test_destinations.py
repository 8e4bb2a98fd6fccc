"""Bins that serve destinations: nothing is mis-sorted, everything is placed, a cut-off closes."""

from __future__ import annotations

from collections import Counter

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from run_checks import TIMED, StartCell

from pack_msgs.srv import CutOff
from pack_msgs_py.ros.testing import private_context

pytestmark = pytest.mark.cell


@pytest.mark.parametrize('destinations', [2, 4])
def test_with_destinations_every_box_is_placed_and_none_is_mis_sorted(
    start_cell: StartCell, destinations: int
) -> None:
    """With more destinations than bins a box waits, on its rounds, until a bin serves it."""
    asked = ('--count', '24', '--destinations', str(destinations))
    cell = start_cell(*TIMED, *asked)
    assert cell.wait(240.0) == 0, cell.text()
    summary, rows = cell.summary(), cell.placements()
    assert (summary['placed'], summary['rejected'], summary['mis_sorts']) == (24, 0, 0)
    assert all(row['destination'] == row['bin_destination'] for row in rows)
    counts = Counter(row['destination'] for row in rows)
    assert set(counts) == {f'D{n + 1}' for n in range(destinations)}
    assert {name: counted['boxes'] for name, counted in summary['destinations'].items()} == counts
    assert summary['waits']['most_laps'] <= 100


def test_a_cut_off_closes_the_bins_of_a_destination_while_the_cell_goes_on(
    start_cell: StartCell, ros_domain: int
) -> None:
    cell = start_cell(*TIMED, '--count', '24', '--destinations', '2', '--speed', '30')
    cell.wait_for_placements(6)
    answer = cut_off('D1', ros_domain)
    assert answer.success, answer.message
    assert len(answer.closed) + len(answer.pending) == 1
    assert cell.wait(240.0) == 0, cell.text()
    summary, rows = cell.summary(), cell.placements()
    assert (summary['placed'], summary['mis_sorts']) == (24, 0)
    (gone,) = (*answer.closed, *answer.pending)
    log = (cell.out / 'log' / 'arm_executor.log').read_text()
    assert f'bin {gone} closed' in log
    later = {row['bin_serial'] for row in rows if row['destination'] == 'D1'}
    assert len(later) >= 2  # what came for it afterwards went into another bin


def cut_off(destination: str, domain: int) -> CutOff.Response:
    """Ask as an operator does."""
    with private_context(domain) as context:
        node = rclpy.create_node('operator', context=context)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        client = node.create_client(CutOff, 'cut_off')
        assert client.wait_for_service(20.0)
        future = client.call_async(CutOff.Request(destination=destination))
        executor.spin_until_future_complete(future, 20.0)
        assert future.done(), 'no answer of cut_off'
        node.destroy_node()
        return future.result()
