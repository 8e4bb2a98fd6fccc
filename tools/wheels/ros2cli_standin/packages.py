"""``ros2 run`` and ``ros2 pkg``: packages and their executables."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from pathlib import Path

from ament_index_python import (
    PackageNotFoundError,
    get_package_prefix,
    get_packages_with_prefixes,
)


def executable_paths(package: str) -> list[str]:
    """Every executable file of a package.

    Raises
    ------
    RuntimeError
        There is no such package.
    """
    try:
        prefix = get_package_prefix(package)
    except (PackageNotFoundError, ValueError):
        msg = f"Package '{package}' not found"
        raise RuntimeError(msg) from None
    return sorted(
        str(path)
        for path in Path(prefix, 'lib', package).rglob('*')
        if path.is_file()
        and os.access(path, os.X_OK)
        and not any(part.startswith('.') for part in path.relative_to(prefix).parts[:-1])
    )


def add_run(parser: argparse.ArgumentParser) -> None:
    """Run a package specific executable."""
    parser.add_argument(
        '--prefix',
        help='Prefix command, which should go before the executable. Command must be wrapped in '
        "quotes if it contains spaces (e.g. --prefix 'gdb -ex run --args').",
    )
    parser.add_argument('package_name', help='Name of the ROS package')
    parser.add_argument('executable_name', help='Name of the executable')
    parser.add_argument(
        'argv', nargs=argparse.REMAINDER, help='Pass arbitrary arguments to the executable'
    )
    parser.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> str:
    paths = [
        path
        for path in executable_paths(arguments.package_name)
        if Path(path).name == arguments.executable_name
    ]
    if not paths:
        return 'No executable found'
    if len(paths) > 1:
        raise RuntimeError('\n- '.join(['Multiple executables found:', *paths]))
    command = [*shlex.split(arguments.prefix or ''), paths[0], *arguments.argv]
    sys.stdout.flush()
    # Takes the place of this process, so that signals reach the node itself.
    try:
        os.execvp(command[0], command)
    except OSError as error:
        return f'{command[0]}: {error.strerror}'


def add_list(parser: argparse.ArgumentParser) -> None:
    """Output a list of available packages."""
    parser.set_defaults(run=_list)


def _list(_arguments: argparse.Namespace) -> None:
    for name in sorted(get_packages_with_prefixes()):
        print(name)


def add_executables(parser: argparse.ArgumentParser) -> None:
    """Output a list of package specific executables."""
    parser.add_argument('package_name', nargs='?', help='The package name')
    parser.add_argument(
        '--full-path', action='store_true', help='Show full path of each executable'
    )
    parser.set_defaults(run=_executables)


def _executables(arguments: argparse.Namespace) -> None:
    name = arguments.package_name
    for package in [name] if name else sorted(get_packages_with_prefixes()):
        for path in executable_paths(package):
            print(path if arguments.full_path else f'{package} {Path(path).name}')


def add_prefix(parser: argparse.ArgumentParser) -> None:
    """Output the prefix path of a package."""
    parser.add_argument('package_name', help='The package name')
    parser.set_defaults(run=_prefix)


def _prefix(arguments: argparse.Namespace) -> str | None:
    try:
        print(get_package_prefix(arguments.package_name))
    except (PackageNotFoundError, ValueError):
        return 'Package not found'
    return None
