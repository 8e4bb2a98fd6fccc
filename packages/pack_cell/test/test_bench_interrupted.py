"""``cell bench`` that is killed or stopped half-way goes on where it was."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ARGUMENTS = [
    'bench', '--algorithms', 'first_fit,mpack_lite', '--bins', 'SYN', '--look-ahead', '5',
    '--collections', '6', '--json', 'r.json', '--plan', 'p.jsonl',
]  # fmt: skip
pytestmark = pytest.mark.slow

TIMEOUT_S = 120.0


def started(folder: Path) -> subprocess.Popen[str]:
    folder.mkdir(exist_ok=True)
    return subprocess.Popen(
        [sys.executable, '-m', 'pack_cell', *ARGUMENTS],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def outcome(folder):
    """Records and plan without what was measured."""
    records = json.loads((folder / 'r.json').read_text())
    plan = [json.loads(line) for line in (folder / 'p.jsonl').read_text().splitlines()]
    return [{**record, 'decision_s': 0} for record in records], [
        {**line, 'seconds': 0} for line in plan
    ]


@pytest.fixture(scope='module')
def uninterrupted(tmp_path_factory):
    folder = tmp_path_factory.mktemp('whole')
    process = started(folder)
    output, error = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, error
    return outcome(folder), output, error


def wait_for_a_collection(folder, process):
    deadline = time.monotonic() + TIMEOUT_S
    while not (folder / 'r.json.unfinished').exists():
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.005)


@pytest.mark.parametrize('number', [signal.SIGKILL, signal.SIGINT])
def test_it_goes_on_with_the_same_result(number, tmp_path, uninterrupted):
    process = started(tmp_path)
    wait_for_a_collection(tmp_path, process)
    process.send_signal(number)
    _, error = process.communicate(timeout=TIMEOUT_S)
    if number is signal.SIGINT:
        assert process.returncode == 130
        assert error.count('\n') == 1 and 'what was finished is kept' in error
    assert not (tmp_path / 'r.json').exists() or len(outcome(tmp_path)[0]) < 2
    again = started(tmp_path)
    _, error = again.communicate(timeout=TIMEOUT_S)
    assert again.returncode == 0, error
    assert outcome(tmp_path) == uninterrupted[0]
    assert not (tmp_path / 'r.json.unfinished').exists()


def test_no_progress_bar_goes_into_a_pipe(uninterrupted):
    _, output, error = uninterrupted
    assert '\x1b' not in output
    assert error == 'wrote r.json\nwrote p.jsonl\n'
