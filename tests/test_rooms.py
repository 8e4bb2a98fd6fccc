"""The packages as a reader finds them: imports run one way, and one name is one thing."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ('pack_msgs_py', 'conveyor_sim', 'pack_planner', 'arm_executor', 'pack_cell')


def code(package: str) -> Path:
    return ROOT / 'packages' / package / package


def rooms(package: str) -> set[str]:
    """Folders and single modules of a package."""
    entries = {path.stem for path in code(package).glob('*.py')} - {'__init__'}
    return entries | {path.parent.name for path in code(package).glob('*/__init__.py')}


def imports_between_rooms(package: str) -> Iterator[tuple[str, str, Path]]:
    """Room that imports, room that is imported, and the file that does it."""
    known = rooms(package)
    for path in sorted(code(package).rglob('*.py')):
        room = path.relative_to(code(package)).with_suffix('').parts[0]
        for node in ast.walk(ast.parse(path.read_text())):
            names = []
            if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names = [f'{node.module}.{alias.name}' for alias in node.names]
            elif isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            for name in names:
                start, *rest = name.split('.')
                if start == package and rest and rest[0] in known - {room}:
                    yield room, rest[0], path


def rooms_on_the_map(package: str) -> list[str]:
    """Rooms in the order of the package's table in docs/architecture.md, top to bottom."""
    text = (ROOT / 'docs' / 'architecture.md').read_text()
    table = text.split(f'| room of `{package}` |', 1)[1].split('\n\n', 1)[0]
    cells = [row.split('|')[1] for row in table.splitlines() if row.startswith('| `')]
    return [room for cell in cells for room in re.findall(r'`(\w+)`', cell)]


@pytest.mark.parametrize('package', PACKAGES)
def test_imports_run_down_the_map_of_the_rooms(package: str) -> None:
    order = rooms_on_the_map(package)
    assert set(order) == rooms(package) and len(order) == len(set(order))
    for importer, imported, path in imports_between_rooms(package):
        if importer != '__init__':
            assert order.index(importer) < order.index(imported), f'{path}: imports {imported}'


def test_no_class_name_is_used_twice() -> None:
    homes = defaultdict(list)
    for package in PACKAGES:
        for path in sorted(code(package).rglob('*.py')):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.ClassDef):
                    homes[node.name].append(str(path.relative_to(ROOT)))
    assert {name: paths for name, paths in homes.items() if len(paths) > 1} == {}


def names_of(source: str) -> list[str]:
    """What a module defines at its top: classes, functions, constants."""
    names = []
    for node in ast.parse(source).body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            names.append(node.name)
        elif isinstance(node, ast.Assign):
            names += [target.id for target in node.targets if isinstance(target, ast.Name)]
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names.append(node.target.id)
    return names


def is_in_the_code(dotted: str) -> bool:
    """Whether there is a module ``dotted``, or something of that name in its module."""
    package, *parts = dotted.split('.')
    base = ROOT / 'packages' / package / package
    path = base.joinpath(*parts)
    if path.with_suffix('.py').exists() or (path / '__init__.py').exists():
        return True
    module = base.joinpath(*parts[:-1]).with_suffix('.py')
    return module.exists() and parts[-1] in names_of(module.read_text())


def test_what_the_glossary_names_is_in_the_code() -> None:
    text = (ROOT / 'docs' / 'glossary.md').read_text()
    packages = '|'.join(path.name for path in (ROOT / 'packages').iterdir())
    dotted = re.findall(rf'`((?:{packages})(?:\.\w+)+)`', text)
    assert len(dotted) > 50
    assert [name for name in dotted if not is_in_the_code(name)] == []
