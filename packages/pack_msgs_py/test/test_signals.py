"""Signals that come while a node is still being imported, and interrupts that get lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from pack_msgs_py.signals import interrupts_kept

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


class InterruptedWhenFreed:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.01)


@pytest.mark.filterwarnings('ignore::pytest.PytestUnraisableExceptionWarning')
def test_an_interrupt_that_python_drops_is_raised_when_it_is_looked_for():
    before = signal.getsignal(signal.SIGINT)
    with interrupts_kept() as look:
        look()
        freed = InterruptedWhenFreed()
        del freed
        with pytest.raises(KeyboardInterrupt):
            look()
    assert signal.getsignal(signal.SIGINT) is before
