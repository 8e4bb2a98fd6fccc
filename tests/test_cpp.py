"""The interfaces in C++: what pack_msgs generates, and the listener of the page about it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from rclpy.serialization import serialize_message

from pack_msgs.msg import PlacementDecision
from pack_msgs_py.cell_values import Decision
from pack_msgs_py.codes import PlacementStatus
from pack_msgs_py.ros.conversions import decision_to_ros
from pack_msgs_py.values import Box

ROOT = Path(__file__).resolve().parents[1]
HERE = Path(__file__).parent / 'cpp'
COMPILER = shutil.which('g++') or shutil.which('c++')

pytestmark = [
    pytest.mark.ros,
    pytest.mark.skipif(COMPILER is None, reason='there is no C++ compiler'),
]


def prefixes() -> list[Path]:
    return [Path(one) for one in os.environ.get('AMENT_PREFIX_PATH', '').split(':') if one]


def includes() -> list[str]:
    """Every folder of headers of the prefixes, as CMake's targets would name them."""
    folders = [
        folder
        for prefix in prefixes()
        if (prefix / 'include').is_dir()
        for folder in (prefix / 'include').iterdir()
        if folder.is_dir()
    ]
    if not any((folder / 'pack_msgs').is_dir() for folder in folders):
        pytest.skip('pack_msgs is not installed here')
    return [word for folder in folders for word in ('-isystem', str(folder))]


def compiled(*words: str) -> None:
    assert COMPILER is not None
    command = [COMPILER, '-std=c++17', '-O0', '-Wall', '-Werror', *words, *includes()]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_listener_of_the_page_compiles_against_the_headers(tmp_path: Path) -> None:
    page = (ROOT / 'docs' / 'interfaces.md').read_text()
    (block,) = re.findall(r'```cpp\n(.*?)```', page, re.DOTALL)
    source = tmp_path / 'listener.cpp'
    source.write_text(block)
    compiled('-fsyntax-only', '-I', str(HERE), str(source))


def test_a_decision_of_the_planner_is_read_in_cpp(tmp_path: Path) -> None:
    program = tmp_path / 'read_decision'
    libraries = [str(prefix / 'lib') for prefix in prefixes() if (prefix / 'lib').is_dir()]
    wheels = [path for path in os.environ.get('LD_LIBRARY_PATH', '').split(':') if path]
    found = [path for path in dict.fromkeys((*libraries, *wheels)) if Path(path).is_dir()]
    words = [str(HERE / 'read_decision.cpp'), '-o', str(program)]
    words += [word for path in found for word in (f'-L{path}', f'-Wl,-rpath-link,{path}')]
    words += ['-lpack_msgs__rosidl_typesupport_cpp', '-lrmw_fastrtps_cpp', '-lrmw', '-lrcutils']
    compiled(*words)
    box = Box('K"1', (300.0, 200.0, 100.0), 2.0, extra=(('sku', '4711'),))
    decision = Decision(
        box, 'LDC-1', status=PlacementStatus.OPTIMAL, corner_mm=(120, 0, 300), orientation='xzy'
    )
    msg: PlacementDecision = decision_to_ros(decision, 'bin_a')
    said = subprocess.run(
        [program], input=serialize_message(msg), capture_output=True, timeout=60, check=True
    )
    assert said.stdout.decode() == 'K"1 LDC-1 xzy 0.120 0.000 0.300 0 1\n'
