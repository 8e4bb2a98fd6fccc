"""Fixtures of the planner's tests."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from pack_msgs_py.profiles import PROFILES
from pack_planner.engine import Engine

# pytest's importlib mode leaves the folder of the tests off the path
sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope='session')
def paper() -> Engine:
    return Engine(PROFILES['paper'])


@pytest.fixture(scope='session')
def cell() -> Engine:
    return Engine(PROFILES['cell'])
