"""What a user can set or hear is documented, and what is documented exists."""

from __future__ import annotations

import re
import runpy
from dataclasses import fields
from pathlib import Path

import pytest
import yaml
from rclpy.qos import LivelinessPolicy

from arm_executor.parameters import ExecutorParameters
from conveyor_sim.parameters import ConveyorParameters
from pack_cell.options.declaration import add_options
from pack_cell.options.parsers import OneLineParser
from pack_cell.options.run_options import RunOptions
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
    assert parameter_table(parameters) in readme(package)


@pytest.mark.parametrize('package', NODES)
def test_the_parameter_file_of_a_node_holds_every_default(package: str) -> None:
    name, parameters = NODES[package]
    path = ROOT / 'packages' / package / 'config' / f'{name}.param.yaml'
    defaults = {field.name: field.default for field in fields(parameters)}
    assert yaml.safe_load(path.read_text()) == {'/**': {'ros__parameters': defaults}}


@pytest.mark.parametrize('topic', TOPICS)
def test_every_topic_is_in_the_readme_of_the_messages_and_of_a_node(topic: str) -> None:
    assert f'`{topic}`' in readme('pack_msgs')
    assert any(f'`{topic}`' in readme(package) for package in [*NODES, 'pack_cell'])


@pytest.mark.parametrize('topic', TOPICS)
def test_the_page_of_the_interfaces_says_what_each_topic_offers(topic: str) -> None:
    page = (ROOT / 'docs' / 'interfaces.md').read_text()
    (row,) = re.findall(rf'^\| `{topic}` \|(.*)\|$', page, re.MULTILINE)
    _, reliability, durability, depth, deadline, liveliness = map(str.strip, row.split('|'))
    profile = TOPICS[topic]
    assert reliability.upper() == profile.reliability.name
    assert durability.upper().replace(' ', '_') == profile.durability.name
    assert int(depth) == profile.depth
    limit_s = profile.deadline.nanoseconds / 1e9
    assert deadline == (f'{limit_s:g} s' if 0 < limit_s < 1e6 else '')
    assert bool(liveliness) == (profile.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC)


def test_the_tables_that_are_made_from_the_code_are_as_the_code_is() -> None:
    pages = runpy.run_path(str(ROOT / 'tools' / 'write_tables'))['pages']()
    for path, text in pages.items():
        assert path.read_text() == text, 'due: ./cell python tools/write_tables'


def test_the_page_of_the_options_lists_every_option_of_run() -> None:
    parser = OneLineParser(prog='cell run')
    add_options(parser, RunOptions)
    text = (ROOT / 'docs' / 'options.md').read_text()
    for action in parser._actions:
        for option in action.option_strings:
            if option.startswith('--') and option != '--help':
                assert option in text, option


def pages() -> list[Path]:
    """Every page that a reader may open."""
    paths = [ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', ROOT / 'CHANGELOG.md']
    for pattern in ('docs/**/*.md', 'packages/*/README.md', 'docker/*.md', 'examples/*.md'):
        paths += sorted(ROOT.glob(pattern))
    return paths


def without_code(text: str) -> str:
    return re.sub(r'(?ms)^ *```.*?^ *```', '', text)


def anchors(page: Path) -> set[str]:
    """The names that a viewer such as GitHub gives to the headings of ``page``."""
    headings = re.findall(r'(?m)^#+ (.*)$', without_code(page.read_text()))
    return {
        re.sub(r'[^\w\- ]', '', heading).strip().lower().replace(' ', '-') for heading in headings
    }


@pytest.mark.parametrize('page', pages(), ids=lambda page: str(page.relative_to(ROOT)))
def test_the_links_of_a_page_lead_somewhere(page: Path) -> None:
    for target, _, anchor in re.findall(
        r'\]\(([^)#:]*)(#([^)]*))?\)', without_code(page.read_text())
    ):
        goal = page.parent / target if target else page
        assert goal.exists(), target
        if anchor and goal.is_dir():
            goal = goal / 'README.md'
        if anchor:
            assert anchor in anchors(goal), f'{target}#{anchor}'


def test_the_python_of_the_readme_runs(capsys: pytest.CaptureFixture[str]) -> None:
    blocks = re.findall(r'(?ms)^```python\n(.*?)^```', (ROOT / 'README.md').read_text())
    for block in blocks:
        exec(compile(block, 'README.md', 'exec'), {})
    assert '60 boxes in' in capsys.readouterr().out
