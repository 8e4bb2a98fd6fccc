"""The text of a message and of all that it is made of, as MCAP's `ros2msg` schemas have it."""

from __future__ import annotations

import importlib
import json
import re
from functools import cache
from pathlib import Path
from typing import Any

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

_SEPARATOR = '=' * 80
_BUILT_IN = re.compile(r'^(bool|byte|char|w?string|float(32|64)|u?int(8|16|32|64))$')


@cache
def message_definition(type_name: str) -> str:
    """Definition of ``type_name``, such as `pack_msgs/msg/BoxScan`; empty when it is not installed.

    The messages that it holds follow, each once, behind a line of `=` and `MSG: package/Name`.
    """
    text = _text_of(type_name)
    if text is None:
        return ''
    parts, seen, waiting = [text], {type_name}, _parts_of(type_name, text)
    while waiting:
        inner = waiting.pop(0)
        if inner in seen:
            continue
        seen.add(inner)
        of_inner = _text_of(inner) or ''
        package, _, name = inner.split('/')
        parts.append(f'{_SEPARATOR}\nMSG: {package}/{name}\n{of_inner}')
        waiting += _parts_of(inner, of_inner)
    return '\n'.join(part.rstrip('\n') for part in parts) + '\n'


@cache
def installed_type_hash(type_name: str) -> str:
    """Hash of the message as it is installed (REP 2016); empty when that is not known."""
    package, kind, name = type_name.split('/')
    try:
        path = Path(get_package_share_directory(package)) / kind / f'{name}.json'
        hashes = json.loads(path.read_text())['type_hashes']
    except (PackageNotFoundError, OSError, ValueError, KeyError):
        return ''
    return next((str(h['hash_string']) for h in hashes if h['type_name'] == type_name), '')


def message_class(type_name: str) -> Any:  # noqa: ANN401 - rclpy is not typed
    """The class of a message; ``LookupError`` when it is not installed."""
    package, kind, name = type_name.split('/')
    try:
        return getattr(importlib.import_module(f'{package}.{kind}'), name)
    except (ImportError, AttributeError) as error:
        msg = f'message type {type_name} is not installed: {error}'
        raise LookupError(msg) from None


def _text_of(type_name: str) -> str | None:
    package, kind, name = type_name.split('/')
    try:
        path = Path(get_package_share_directory(package)) / kind / f'{name}.msg'
        return path.read_text()
    except (PackageNotFoundError, OSError):
        return None


def _parts_of(type_name: str, text: str) -> list[str]:
    """Full names of the messages that are fields of one."""
    package = type_name.split('/')[0]
    names = []
    for line in text.splitlines():
        words = line.split('#', 1)[0].split()
        if not words:
            continue
        kind = re.split(r'[\[<]', words[0], maxsplit=1)[0]
        if _BUILT_IN.match(kind):
            continue
        parts = kind.split('/')
        names.append(f'{parts[0] if len(parts) > 1 else package}/msg/{parts[-1]}')
    return names
