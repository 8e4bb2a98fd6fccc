"""Signals that come while a node is still being imported."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

IMPORTING = """
import sys, time
from pack_msgs_py.signals import signals_end_quietly
with signals_end_quietly():
    print('importing', flush=True)
    time.sleep(60)
"""


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_during_the_import_ends_the_process_with_code_0(number):
    process = subprocess.Popen([sys.executable, '-c', IMPORTING], stdout=subprocess.PIPE)
    try:
        assert process.stdout.readline() == b'importing\n'
        process.send_signal(number)
        assert process.wait(10) == 0
    finally:
        process.kill()
        process.stdout.close()


def test_afterwards_signals_are_what_they_were():
    from pack_msgs_py.signals import signals_end_quietly

    before = signal.getsignal(signal.SIGTERM)
    with signals_end_quietly():
        assert signal.getsignal(signal.SIGTERM) is not before
    assert signal.getsignal(signal.SIGTERM) is before
