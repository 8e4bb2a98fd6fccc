"""Compiled code is never older than the sources it was made from."""

from __future__ import annotations

import importlib
import os
import pkgutil
import subprocess
import sys
import time
from pathlib import Path

from numba.core.dispatcher import Dispatcher

import pack_planner
import pack_planner.joint
from pack_planner.machine_code import version_of

_CALLER = """
from numba import njit
from called import called

@njit(cache=True)
def caller():
    return called()
"""
_CALLED = """
from numba import njit

@njit(cache=True)
def called():
    return {}
"""
_RUN = """
import sys
import time
from pathlib import Path
from pack_planner.machine_code import keep_apart
keep_apart(Path(sys.argv[1]))
sys.path.insert(0, sys.argv[1])
from caller import caller
print(caller())
"""


def run(folder: Path, **environment: str) -> str:
    ended = subprocess.run(
        [sys.executable, '-c', _RUN, str(folder)],
        capture_output=True, text=True, check=True, env={**os.environ, **environment},
    )  # fmt: skip
    return ended.stdout.strip()


def test_a_change_in_what_a_function_calls_is_seen(tmp_path):
    sources, cache = tmp_path / 'sources', tmp_path / 'cache'
    sources.mkdir()
    (sources / 'caller.py').write_text(_CALLER)
    for value in ('1', '22'):
        (sources / 'called.py').write_text(_CALLED.format(value))
        assert run(sources, NUMBA_CACHE_DIR=str(cache)) == value


def test_what_was_compiled_long_ago_of_other_versions_is_deleted(tmp_path):
    sources, cache = tmp_path / 'sources', tmp_path / 'cache'
    sources.mkdir()
    (sources / 'caller.py').write_text(_CALLER)
    (sources / 'called.py').write_text(_CALLED.format(1))
    for name, age in (('sources-old', 2 * 86400), ('sources-new', 60), ('other', 2 * 86400)):
        (cache / name).mkdir(parents=True)
        os.utime(cache / name, (time.time() - age,) * 2)
    assert run(sources, NUMBA_CACHE_DIR=str(cache)) == '1'
    assert {path.name for path in cache.iterdir()} == {
        'sources-new', 'other', version_of(sources)
    }  # fmt: skip


def test_a_process_started_by_another_one_shares_its_compiled_code():
    version = version_of(Path(pack_planner.__file__).parent)
    shown = 'import os, pack_planner; print(os.environ["NUMBA_CACHE_DIR"])'
    ended = subprocess.run(
        [sys.executable, '-c', shown], capture_output=True, text=True, check=True
    )
    assert ended.stdout.strip() == os.environ['NUMBA_CACHE_DIR']
    assert Path(ended.stdout.strip()).name == version
    assert Path(ended.stdout.strip()).parent.name != version


def counts_references(function: Dispatcher) -> bool:
    return bool(function.targetoptions.get('_nrt', True))


def test_what_is_compiled_without_counting_calls_nothing_that_counts():
    """Numba would compile that without counting too, if it came to it this way first, and fail."""
    checked = 0
    for module in pkgutil.walk_packages(pack_planner.joint.__path__, 'pack_planner.joint.'):
        names = vars(importlib.import_module(module.name))
        for function in [value for value in names.values() if isinstance(value, Dispatcher)]:
            if counts_references(function):
                continue
            for name in function.py_func.__code__.co_names:
                called = function.py_func.__globals__.get(name)
                if isinstance(called, Dispatcher):
                    assert not counts_references(called), f'{function} calls {called}'
                    checked += 1
    assert checked > 10
