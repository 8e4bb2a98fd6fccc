"""The page of a replay in a browser: drawn, stepped through, nothing to complain about."""

from __future__ import annotations

from pathlib import Path

import pytest
from page_client import CHROMIUM, Browser, wait_until
from test_replay_timeline import BOX, DECISION, EMPTY, FULL, URDF, snapshot

from pack_cell.recording.heard import ArmMode, FixedFrame, Heard, JointPositions, RobotText
from pack_cell.replay.page import replay_page
from pack_msgs_py.cell_values import BoxEvent, Scan, ScannedBox
from pack_msgs_py.codes import BoxEventKind, Mode
from pack_msgs_py.geometry.pose import Pose

SAID = [
    (0.0, RobotText(URDF)),
    (0.0, FixedFrame('bin_a', 'cell', Pose((0.5, 0.6, 0.15)))),
    (0.0, FixedFrame('belt', 'cell', Pose((0.0, 0.55, 0.75)))),
    (0.0, ArmMode(Mode.IDLE)),
    (0.0, JointPositions(('rail',), (0.0,))),
    (0.0, Scan(1, 0.0, (ScannedBox(BOX, Pose((0.0, 0.65, 0.8))),))),
    (0.0, snapshot(EMPTY)),
    (2.0, DECISION),
    (3.0, BoxEvent('a', BoxEventKind.PICKED, stamp_s=3.0)),
    (3.0, Scan(2, 3.0)),
    (6.0, JointPositions(('rail',), (0.6,))),
    (7.0, BoxEvent('a', BoxEventKind.PLACED, stamp_s=7.0)),
    (7.0, snapshot(FULL)),
    (8.0, ArmMode(Mode.PROTECTIVE_STOP, 'stopped by hand')),
]


@pytest.mark.slow
@pytest.mark.skipif(not CHROMIUM, reason='there is no browser')
def test_the_page_is_drawn_steps_by_decision_and_plays(tmp_path: Path) -> None:
    path = tmp_path / 'replay.html'
    heard = [Heard(when, '', value) for when, value in SAID]
    path.write_text(replay_page('monday', heard), encoding='utf-8')
    with Browser(path.as_uri()) as browser:

        def text(name: str) -> str:
            return str(browser.evaluate(f"document.getElementById('{name}').textContent"))

        wait_until(lambda: 'Decision 1 of 1' in text('decision'), 'the first decision')
        assert text('mode') == 'RUN'
        assert '0 boxes' in text('figures')
        browser.evaluate("document.getElementById('forth').click()")
        wait_until(lambda: '1 box' in text('figures'), 'the end')
        assert text('mode') == 'PROTECTIVE STOP: stopped by hand'
        browser.evaluate("document.getElementById('back').click()")
        wait_until(lambda: '0:02.0' in text('clock'), 'one decision back')
        browser.evaluate("document.getElementById('speed').value = '10'")
        browser.evaluate("document.getElementById('play').click()")
        wait_until(lambda: '1 box' in text('figures'), 'played to the end')
        drawn = (
            "(() => { const view = document.getElementById('view'); const all = new Uint8Array(4 *"
            " view.width * view.height); view.getContext('webgl').readPixels(0, 0, view.width,"
            ' view.height, 6408, 5121, all); return new Set(new Uint32Array(all.buffer)).size })()'
        )
        assert browser.evaluate(drawn) > 8
        assert browser.errors == []
