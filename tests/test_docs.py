"""What a user can set or hear is documented, and what is documented exists."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest
import yaml

from arm_executor.parameters import ExecutorParameters
from conveyor_sim.parameters import ConveyorParameters
from pack_cell.options import OneLineParser, add_run_options
from pack_msgs_py.parameter_fields import parameter_table
from pack_msgs_py.ros.qos import TOPICS
from pack_planner.parameters import PlannerParameters

ROOT = Path(__file__).resolve().parents[1]
NODES = {
    'conveyor_sim': ('conveyor', ConveyorParameters),
    'pack_planner': ('planner', PlannerParameters),
    'arm_executor': ('arm_executor', ExecutorParameters),
}


def readme(package: str) -> str:
    return (ROOT / 'packages' / package / 'README.md').read_text()


@pytest.mark.parametrize('package', NODES)
def test_the_readme_of_a_node_has_the_table_that_its_parameters_give(package: str) -> None:
    _, parameters = NODES[package]
    for row in parameter_table(parameters).splitlines()[2:]:
        assert row in readme(package)


@pytest.mark.parametrize('package', NODES)
def test_the_parameter_file_of_a_node_holds_every_default(package: str) -> None:
    name, parameters = NODES[package]
    path = ROOT / 'packages' / package / 'config' / f'{name}.param.yaml'
    values = yaml.safe_load(path.read_text())['/**']['ros__parameters']
    assert values == {one.name: one.default for one in fields(parameters)}


@pytest.mark.parametrize('topic', TOPICS)
def test_every_topic_is_in_the_readme_of_the_messages_and_of_a_node(topic: str) -> None:
    assert f'`{topic}`' in readme('pack_msgs')
    assert any(f'`{topic}`' in readme(package) for package in NODES)


def test_the_readme_lists_every_option_of_run() -> None:
    parser = OneLineParser(prog='cell run')
    add_run_options(parser, ('mpack_lite',))
    text = (ROOT / 'README.md').read_text() + readme('pack_cell')
    for action in parser._actions:
        for option in action.option_strings:
            if option.startswith('--') and option != '--help':
                assert option in text, option


def test_links_between_the_pages_lead_somewhere() -> None:
    pages = [ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *ROOT.glob('docs/*.md')]
    for page in [*pages, *ROOT.glob('packages/*/README.md'), *ROOT.glob('docker/*.md')]:
        text = re.sub(r'(?ms)^ *```.*?^ *```', '', page.read_text())
        for target in re.findall(r'\]\(([^)#:]+)(?:#[^)]*)?\)', text):
            assert (page.parent / target).exists(), f'{page.relative_to(ROOT)}: {target}'
