"""The live page: served to its own address alone, seen in a browser, of no effect on the cell."""

from __future__ import annotations

import os
import queue
import re
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import replace

import pytest
from page_client import CHROMIUM, Browser, SocketClient, page_state, wait_until
from run_checks import TIMED, StartCell, assert_every_box_in_one_place
from view_cases import (
    PLACED,
    beat,
    bins_of,
    box,
    decision_for,
    event_for,
    new_view,
    report_for,
    scan_of,
)
from websockets.exceptions import InvalidStatus

from pack_cell.view.page import CellPage, Order, PageAddress
from pack_cell.view.web_server import PageTaken
from pack_msgs_py.codes import BoxEventKind, ErrorCode, Mode

#: The word on the banner.
NAME = "document.querySelector('#cell-banner .name')?.innerText"


class Served:
    """A page in this process, with what its buttons asked for."""

    def __init__(self) -> None:
        self.view = new_view()
        self.orders: queue.Queue[tuple[Order, str]] = queue.Queue()
        self.page = CellPage(
            self.view, PageAddress('127.0.0.1', 0), lambda *order: self.orders.put(order)
        )
        self.url = f'http://127.0.0.1:{self.page.port}/'

    def refresh(self) -> None:
        self.page.refresh_state()
        self.page.refresh_text()
        self.page.refresh_scene()

    def order(self) -> tuple[Order, str]:
        return self.orders.get(timeout=30)


@pytest.fixture
def served() -> Iterator[Served]:
    page = Served()
    page.view.on_bins(bins_of(PLACED))
    page.view.on_scan(scan_of(box(1), box(2)))
    page.view.on_decision(decision_for(box(1)))
    page.refresh()
    yield page
    page.page.close()


def test_page_and_state_come_without_any_address_outside(served: Served) -> None:
    with urllib.request.urlopen(served.url, timeout=30) as answer:
        text = answer.read().decode()
    assert 'cell-banner' in text
    head = text[: text.index('data-p=')]
    assert set(re.findall(r'https?://[^/\'"]+', head)) <= {'http://www.w3.org'}
    assert page_state(served.url)['word'] == 'RUN'


def test_a_page_of_somebody_else_cannot_reach_the_buttons(served: Served) -> None:
    with pytest.raises(InvalidStatus):
        SocketClient(served.url, origin='http://elsewhere.example')
    request = urllib.request.Request(
        served.url + 'state.json', headers={'Origin': 'http://elsewhere.example'}
    )
    with pytest.raises(urllib.error.HTTPError, match='403'):
        urllib.request.urlopen(request, timeout=30)


def test_a_port_that_is_taken_is_named_and_another_one_advised() -> None:
    with socket.socket() as other:
        other.bind(('127.0.0.1', 0))
        other.listen()
        port = other.getsockname()[1]
        address = PageAddress('127.0.0.1', port)
        with pytest.raises(PageTaken, match=rf'port {port}: .*--port'):
            CellPage(new_view(), address, lambda *order: None)


def test_buttons_ask_for_what_they_say(served: Served) -> None:
    client = SocketClient(served.url)
    for label, order in (
        ('Pause', Order.PAUSE),
        ('Stop', Order.STOP),
        ('Swap: close it, an empty one comes', Order.SWAP_BIN),
        ('Close it, and leave its place empty', Order.CLOSE_BIN),
        ('Hold: no more boxes into it', Order.HOLD_BIN),
        ('Release: boxes go into it again', Order.RELEASE_BIN),
    ):
        client.press(label)
        assert served.order() == (order, 'LDC-1')
    client.close()


def test_what_cannot_be_undone_is_asked_back(served: Served) -> None:
    for label, order in (
        ('Empty the belt to the reject lane', Order.EMPTY),
        ('Finish the shift', Order.FINISH),
    ):
        for answer in ('No', f'Yes: {label.lower()}'):
            client = SocketClient(served.url)
            client.press(label)
            client.press(answer)
            client.wait_for(lambda message: message['type'] == 'GuiCloseModalMessage', 'closed')
            client.close()
        assert served.order() == (order, ''), 'asked for once, after the yes'
        assert served.orders.empty()


def test_boxes_are_sent_as_batches_and_only_when_they_change(served: Served) -> None:
    client = SocketClient(served.url)
    client.wait_for(lambda message: message.get('name') == '/ghosts/boxes', 'the ghost')
    batches = [m for m in client.messages if m['type'] == 'BatchedMeshesMessage']
    assert {m['name'] for m in batches} == {
        f'/{name}/boxes' for name in ('solid', 'walls', 'placed', 'waiting', 'ghosts')
    }
    client.messages.clear()
    served.view.on_scan(replace(scan_of(box(1), box(2)), sequence=2))
    served.refresh()
    served.view.on_event(event_for(box(1), BoxEventKind.REJECTED))
    served.refresh()
    client.wait_for(lambda message: message['type'] == 'RemoveSceneNodeMessage', 'no ghost')
    changed = {m['name'] for m in client.messages if m['type'] == 'SceneNodeUpdateMessage'}
    assert changed == {'/waiting/boxes'}, 'bins and belt stand as before'
    client.close()


@pytest.mark.slow
@pytest.mark.skipif(not CHROMIUM, reason='no Chromium here')
def test_in_a_browser_figures_change_and_a_button_pauses_the_cell(served: Served) -> None:
    with Browser(served.url) as browser:
        assert browser.wait_for(NAME) == 'RUN'
        browser.wait_for("document.querySelector('canvas') != null")
        served.view.on_report(report_for(box(1), ErrorCode.GRASP_FAILED))
        served.view.on_event(event_for(box(1), BoxEventKind.PLACED))
        served.refresh()
        browser.wait_for("document.querySelector('.tiles b')?.innerText.startsWith('1')")
        browser.wait_for("document.querySelector('.alarm b')?.innerText.includes('take hold')")
        browser.press('Pause')
        assert served.order()[0] is Order.PAUSE
        beat(served.view, Mode.PAUSED)
        served.refresh()
        browser.wait_for(f"{NAME} == 'PAUSED'")
        browser.press('Resume')
        assert served.order()[0] is Order.RESUME
        served.page.close()
        browser.wait_for(f"{NAME} == 'NO CONNECTION'")
        quiet = [text for text in browser.errors if 'ERR_CONNECTION_REFUSED' not in text]
        assert quiet == []


@pytest.mark.cell
def test_a_page_that_pauses_the_cell_and_is_killed_again_and_again_costs_no_box(
    start_cell: StartCell, ros_domain: int
) -> None:
    cell = start_cell('--count', '24', *TIMED, '--speed', '4', '--view', '--view-port', '0')
    url = cell.wait_for_line('is shown at').split()[-1]
    cell.wait_for_placements(1)
    wait_until(lambda: page_state(url)['placed'] >= 1, 'a figure that changes')
    client = SocketClient(url)
    client.press('Pause')
    wait_until(lambda: page_state(url)['word'] == 'PAUSED', 'PAUSED')
    client.press('Resume')
    wait_until(lambda: page_state(url)['word'] == 'RUN', 'RUN')
    client.close()
    for _ in range(3):
        other = subprocess.Popen(
            [sys.executable, '-m', 'pack_cell', 'view', '--port', '0'],
            stdout=subprocess.PIPE,
            text=True,
            env=dict(os.environ, ROS_DOMAIN_ID=str(ros_domain)),
        )
        assert other.stdout is not None
        beside = other.stdout.readline().split()[-1]
        wait_until(lambda at=beside: page_state(at)['word'] == 'RUN', 'the page beside it')
        other.send_signal(signal.SIGKILL)
        other.wait()
        other.stdout.close()
    assert cell.wait() == 0, cell.text()
    assert_every_box_in_one_place(cell, 24)
    assert cell.summary()['problems'] == []


@pytest.mark.ros
def test_cell_view_starts_without_a_cell_says_where_it_is_and_ends_at_a_signal(
    ros_domain: int,
) -> None:
    command = [sys.executable, '-m', 'pack_cell', 'view', '--port']
    page = subprocess.Popen(
        [*command, '0'], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert page.stdout is not None
    url = page.stdout.readline().split()[-1]
    state = wait_until(lambda: page_state(url), 'the page')
    assert state['word'] == 'NO CELL' and str(ros_domain) in state['now']
    port = url.rstrip('/').rpartition(':')[2]
    second = subprocess.run([*command, port], capture_output=True, text=True, timeout=60)
    assert second.returncode == 2 and f'port {port}' in second.stderr, second.stderr
    page.send_signal(signal.SIGINT)
    assert page.wait(timeout=30) == 0, page.communicate()
