"""README and configuration say what the code does."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import yaml

from arm_executor.parameters import ExecutorParameters
from pack_msgs_py.parameter_fields import parameter_table

PACKAGE = Path(__file__).parents[1]


def test_the_readme_holds_the_table_of_parameters():
    assert parameter_table(ExecutorParameters) in (PACKAGE / 'README.md').read_text()


def test_the_configuration_names_every_parameter_with_its_default():
    text = (PACKAGE / 'config' / 'arm_executor.param.yaml').read_text()
    assert yaml.safe_load(text) == {'/**': {'ros__parameters': asdict(ExecutorParameters())}}
