"""The node behind the live page, with a real belt and arm in a namespace of their own."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

pytest.importorskip('rclpy')

from page_client import SocketClient, page_state, wait_until
from rclpy.parameter import Parameter

from arm_executor.ros.node import ArmExecutor
from conveyor_sim.ros.node import ConveyorNode
from pack_cell.ros.viewer import WHO, Viewer
from pack_cell.view.page import PageAddress
from pack_msgs_py.ros.testing import Spinner

pytestmark = pytest.mark.ros


@pytest.fixture
def viewer(ros_domain: int) -> Iterator[Viewer]:
    """The page beside belt and arm; there is no planner."""

    def values(**given: object) -> list[Parameter]:
        return [Parameter(name, value=value) for name, value in given.items()]

    with Spinner() as spinner, Spinner() as page_spinner:
        arm = ArmExecutor(
            context=spinner.context,
            namespace='north',
            parameter_overrides=values(arm='timed', speed=0.0, open_bins=2),
        )
        spinner.add(arm, arm.stop_motion)
        spinner.add(
            ConveyorNode(
                context=spinner.context,
                namespace='north',
                parameter_overrides=values(speed=0.0, count=20),
            )
        )
        node = Viewer(PageAddress('127.0.0.1', 0), context=page_spinner.context, namespace='north')
        yield page_spinner.add(node)


def look(viewer: Viewer) -> SocketClient:
    """A client that sees belt and bins."""
    client = SocketClient(viewer.url)
    client.wait_for(lambda message: message.get('name') == '/waiting/boxes', 'boxes on the belt')
    client.wait_for(lambda message: 'options' in message.get('updates', {}), 'names of bins')
    return client


def test_buttons_reach_arm_and_belt_and_the_answer_is_shown(viewer: Viewer) -> None:
    client = look(viewer)

    def shown(text: str) -> None:
        client.wait_for(lambda message: text in str(message), text)

    for label, answer in (
        ('Pause', 'the arm is paused'),
        ('Resume', 'the arm goes on'),
        ('Drain: feed no more boxes', 'feed'),
        ('Stop', 'the arm stops'),
        ('Hold: no more boxes into it', 'is held'),
        ('Release: boxes go into it again', 'is filled again'),
        ('Swap: close it, an empty one comes', 'LDC-3'),
    ):
        client.press(label)
        shown(answer)
    client.wait_for(lambda message: 'LDC-3' in message.get('updates', {}).get('options', ()), 'it')
    client.press('Close it, and leave its place empty')
    shown('stays empty')
    client.close()


def test_a_finished_shift_empties_the_belt_and_closes_the_bins_when_somebody_confirms_it(
    viewer: Viewer,
) -> None:
    client = look(viewer)
    client.press('Finish the shift')
    client.press('Yes: finish the shift')
    for text in ('the arm is paused', 'reject lane', 'no bin holds a box', 'the arm goes on'):
        client.wait_for(lambda message, text=text: text in str(message), text)
    client.close()


def test_while_nobody_looks_the_page_rests_and_is_awake_at_once_for_who_comes(
    viewer: Viewer,
) -> None:
    wait_until(lambda: not viewer.looked_at.is_set(), 'rest')
    client = look(viewer)
    assert viewer.looked_at.is_set()
    client.close()
    wait_until(lambda: not viewer.looked_at.is_set(), 'rest again')


def test_a_pause_of_the_page_is_a_state_of_the_cell_with_its_author(viewer: Viewer) -> None:
    client = look(viewer)
    client.press('Pause')
    state = wait_until(lambda: _when_paused(viewer.url), 'PAUSED by the page')
    assert WHO in state['now'] and state['action'].endswith('press Resume')
    client.press('Resume')
    wait_until(lambda: not _when_paused(viewer.url), 'no longer paused')
    client.close()


def _when_paused(url: str) -> dict[str, object] | None:
    state = page_state(url)
    return state if WHO in state['now'] or state['word'] == 'PAUSED' else None
