"""``ros2 interface``, and finding the Python class of an interface by its name."""

from __future__ import annotations

import argparse
import importlib
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from ament_index_python import get_resource, get_resources

#: ``msg``, ``srv`` or ``action``: what it is called in lists.
KINDS = {'msg': 'Messages', 'srv': 'Services', 'action': 'Actions'}
_PRIMITIVE = re.compile(r'(bool|byte|char|float32|float64|u?int(8|16|32|64)|w?string)\b')


def load_interface(name: str) -> type:
    """The class of ``package/kind/Name``; ``package/Name`` is taken for a message.

    Raises
    ------
    AttributeError, ModuleNotFoundError, ValueError
        There is none of this name.
    """
    parts = name.split('/')
    if len(parts) == 2:
        parts.insert(1, 'msg')
    if len(parts) != 3 or not all(parts):
        msg = f"'{name}' is not of the form 'package/msg/Name'"
        raise ValueError(msg)
    interface: type = getattr(importlib.import_module('.'.join(parts[:2])), parts[2])
    return interface


def add_list(parser: argparse.ArgumentParser) -> None:
    """List all interface types available."""
    for letter, kind in (('m', 'msg'), ('s', 'srv'), ('a', 'action')):
        plural = f'{kind}s'
        parser.add_argument(
            f'-{letter}',
            f'--only-{plural}',
            dest=f'only_{kind}',
            action='store_true',
            help=f'Print out only the {KINDS[kind].lower()[:-1]} types',
        )
    parser.set_defaults(run=_list)


def _list(arguments: argparse.Namespace) -> None:
    wanted = [kind for kind in KINDS if getattr(arguments, f'only_{kind}')] or list(KINDS)
    packages = sorted(get_resources('rosidl_interfaces'))
    for kind in wanted:
        print(f'{KINDS[kind]}:')
        for package in packages:
            content, _ = get_resource('rosidl_interfaces', package)
            names = {
                line.rpartition('.')[0]
                for line in content.splitlines()
                if line.startswith(f'{kind}/')
            }
            for name in sorted(names):
                print(f'    {package}/{name}')


def add_show(parser: argparse.ArgumentParser) -> None:
    """Output the interface definition."""
    comments = parser.add_mutually_exclusive_group()
    comments.add_argument(
        '--all-comments',
        action='store_true',
        help='Show all comments, including for nested interface definitions',
    )
    comments.add_argument(
        '--no-comments', action='store_true', help='Show no comments or whitespace'
    )
    parser.add_argument(
        'type',
        help="Show an interface definition (e.g. 'example_interfaces/msg/String'). "
        "Passing '-' reads the argument from stdin",
    )
    parser.set_defaults(run=_show)


def _show(arguments: argparse.Namespace) -> str | None:
    name = sys.stdin.readline().strip() if arguments.type == '-' else arguments.type
    try:
        lines = _shown_lines(name, not arguments.no_comments, arguments.all_comments)
        for line in lines:
            print(line)
    except (ValueError, LookupError) as error:
        return str(error)
    return None


def _shown_lines(
    name: str, comments: bool, nested_comments: bool, indent: str = ''
) -> Iterator[str]:
    parts = name.split('/')
    if len(parts) != 3:
        msg = f"Invalid name '{name}'. Expected three parts separated by '/'"
        raise ValueError(msg)
    for line in _definition(*parts).read_text(encoding='utf-8').splitlines():
        text, mark, comment = line.rstrip().partition('#')
        if comments:
            yield indent + line.rstrip() if line.rstrip() else ''
        elif mark and not comment:
            # ros2cli does not count a lone '#' as a comment.
            yield indent + text + mark
        elif text.strip():
            # Nor does it take away the '#' itself where a space follows it.
            rest = mark if comment.startswith(' ') else ''
            yield indent + ((text + rest).strip() if mark else text.rstrip())
        nested = _nested_type(parts[0], text)
        if nested:
            yield from _shown_lines(nested, nested_comments, nested_comments, indent + '\t')


def _definition(package: str, kind: str, name: str) -> Path:
    """The file that defines an interface."""
    try:
        content, prefix = get_resource('rosidl_interfaces', package)
    except LookupError:
        msg = f"Unknown package '{package}'"
        raise LookupError(msg) from None
    for suffix in (kind, 'idl'):
        if f'{kind}/{name}.{suffix}' in content.splitlines():
            return Path(prefix, 'share', package, kind, f'{name}.{suffix}')
    msg = f"Could not find the interface '{package}/{kind}/{name}'"
    raise LookupError(msg)


def _nested_type(package: str, text: str) -> str | None:
    """The interface that a field of this line has as its type."""
    words = text.split()
    if len(words) < 2 or _PRIMITIVE.match(words[0]) or '=' in text.partition(words[0])[2][:1]:
        return None
    name = words[0].partition('[')[0]
    if not re.fullmatch(r'(\w+/)?(\w+/)?[A-Z]\w*', name):
        return None
    parts = name.split('/')
    return '/'.join([parts[0] if len(parts) > 1 else package, 'msg', parts[-1]])
