"""Where the executables of the nodes are installed."""

from __future__ import annotations

import os
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_prefix

#: Node name to (package, executable).
NODES = {
    'conveyor': ('conveyor_sim', 'conveyor'),
    'planner': ('pack_planner', 'planner'),
    'arm_executor': ('arm_executor', 'arm_executor'),
}


def executable(package: str, name: str) -> Path:
    """Path of an installed node executable; ``FileNotFoundError`` says what to build."""
    try:
        path = Path(get_package_prefix(package)) / 'lib' / package / name
    except PackageNotFoundError:
        path = Path(package)
    if not os.access(path, os.X_OK):
        msg = f'package {package} is not built: run ./cell setup, or colcon build in packages/'
        raise FileNotFoundError(msg)
    return path
