"""Fixtures of the planner's tests."""

from __future__ import annotations

import pytest
from planner_cases import engine_of

from pack_msgs_py.profiles import PROFILES
from pack_planner.engine import Engine


@pytest.fixture(scope='session')
def paper() -> Engine:
    return engine_of(PROFILES['paper'])


@pytest.fixture(scope='session')
def cell() -> Engine:
    return engine_of(PROFILES['cell'])
