"""Every field of a message, and what a broken or hostile sender may put into it.

Works on anything that names its fields as generated messages do; imports no ROS.
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Iterator
from typing import Any

#: Names and list indices from a message down to one of its fields.
Path = tuple[str | int, ...]

_DOUBLES = (
    *(math.nan, math.inf, -math.inf, 1e300, -1e300, 1.7e308, -1.7e308, 5e-324, -0.0, 0.0),
    *(1e6, -1e6, 1e9, 0.1, -0.001, 2.0**53),
)
_TEXTS = (
    *('', 'x', 'x' * 300, 'x' * 100_000, '../../etc/passwd', '<script>alert(1)</script>'),
    *('\x1b[2J\x1b[31m', 'a\nb', '\x00', "'; DROP TABLE boxes; --", '=1+1', '\u202e', 'nan'),
)


def _integers(bits: int, *, signed: bool) -> tuple[int, ...]:
    low = -(2 ** (bits - 1)) if signed else 0
    high = 2 ** (bits - 1) - 1 if signed else 2**bits - 1
    return (low, high, 0, 1, 2, high // 2, *((-1,) if signed else ()))


#: What is put into a field, by its type.
HOSTILE: dict[str, tuple[Any, ...]] = {
    'double': _DOUBLES,
    'float': (math.nan, math.inf, -math.inf, 3e38, -3e38, 0.0, 1e-45),
    'boolean': (True, False),
    'string': _TEXTS,
    **{
        f'{"" if signed else "u"}int{bits}': _integers(bits, signed=signed)
        for bits in (8, 16, 32, 64)
        for signed in (True, False)
    },
}
#: Lists of messages grow to so many, or shrink to none.
_LENGTHS = (0, 2, 300)


def fields_of(message: Any) -> Iterator[tuple[Path, str]]:  # noqa: ANN401 - any message
    """Way to every field that holds a value, and its type; of a list of messages the first."""
    for name, kind in message.get_fields_and_field_types().items():
        value = getattr(message, name)
        if hasattr(value, 'get_fields_and_field_types'):
            yield from (((name, *path), inner) for path, inner in fields_of(value))
        elif isinstance(value, list):
            yield (name,), 'sequence'
            if value and hasattr(value[0], 'get_fields_and_field_types'):
                yield from (((name, 0, *path), inner) for path, inner in fields_of(value[0]))
        elif re.sub(r'\[\d+\]$', '', kind) in HOSTILE and not kind.endswith(']'):
            yield (name,), kind


def choices(message: Any, path: Path, kind: str) -> tuple[Any, ...]:  # noqa: ANN401 - any message
    """What may be put into the field at ``path``."""
    if kind != 'sequence':
        return HOSTILE[kind]
    items = get(message, path)
    return tuple(list(items[:1]) * length for length in _LENGTHS)


def get(message: Any, path: Path) -> Any:  # noqa: ANN401 - any message, any field
    """The value at ``path``."""
    for step in path:
        message = message[step] if isinstance(step, int) else getattr(message, step)
    return message


def put(message: Any, path: Path, value: Any) -> None:  # noqa: ANN401 - any message, any field
    """Set the value at ``path``."""
    setattr(get(message, path[:-1]), str(path[-1]), value)


def spoil(message: Any, chance: random.Random) -> str:  # noqa: ANN401 - any message
    """Put something hostile into one to three fields of ``message``; returns what, for people."""
    told = []
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        ways = list(fields_of(message))
        if not ways:
            return 'nothing to spoil'
        path, kind = chance.choice(ways)
        value = chance.choice(choices(message, path, kind))
        put(message, path, value)
        text = f'{len(value)} items' if isinstance(value, list) else repr(value)[:40]
        told.append(f'{".".join(map(str, path))} = {text}')
    return ', '.join(told)
