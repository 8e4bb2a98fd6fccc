"""Tables of tuned weights: the shipped one, files of one's own, and what an algorithm gets of them.

The file is JSON: ``format`` and ``version``, and a list of ``entries``, each with the algorithm,
the bin, the profile and the orientation rule that it was tuned for, its ``weights`` by name, and
under ``made`` how that was done and what came of it. ``cell tune`` writes such files; the one
beside this module is what algorithms use when nobody names another.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from pack_msgs_py.orientation import ORIENTATION_RULES
from pack_msgs_py.profiles import PROFILES, Profile
from pack_msgs_py.values import BinSpec
from pack_planner.algorithms.tuned_weights import OTHER, TunedEntry, TunedTable, W, distance

FORMAT, VERSION = 'tuned weights of packing algorithms', 1
SHIPPED_FILE = Path(__file__).with_name('tuned_weights.json')

#: No weight is larger than this, whatever its sign.
LARGEST = 1e4


def weights_for(
    table: TunedTable | None, algorithm: str, default: W, spec: BinSpec, profile: Profile
) -> W:
    """The weights that ``algorithm`` is to use.

    Parameters
    ----------
    table : of a file that the user named, of which the nearest entry counts; with ``None`` the
        shipped table, where another kind of support or of turning leaves it at ``default``.
    algorithm : its name.
    default : its weights where none are tuned; the type of the answer.
    spec : kind of bin.
    profile : packing rules.
    """
    return _weights_for(table, algorithm, default, spec, profile)  # type: ignore[return-value]


@lru_cache(maxsize=256)
def _weights_for(
    table: TunedTable | None, algorithm: str, default: object, spec: BinSpec, profile: Profile
) -> object:
    entry = (table or shipped_table()).nearest(algorithm, spec, profile)
    if entry is None:
        return default
    if table is None and OTHER in distance(entry, spec, profile)[:2]:
        return default
    return entry.over(default)


def check_table(table: TunedTable, algorithm: str, default: object) -> None:
    """Refuse a table that is not for ``algorithm``, whose own weights are ``default``.

    Raises
    ------
    ValueError
        The algorithm has no weights to tune, the table has none for it, or one that it lacks.
    """
    if default is None:
        msg = f'algorithm {algorithm!r} has no weights to tune: leave {table.source} out'
        raise ValueError(msg)
    mine = [entry for entry in table.entries if entry.algorithm == algorithm]
    if not mine:
        others = ', '.join(sorted({entry.algorithm for entry in table.entries})) or 'nothing'
        msg = f'{table.source} is for {others}, not for {algorithm}'
        raise ValueError(msg)
    for entry in mine:
        try:
            entry.over(default)
        except ValueError as error:
            msg = f'{table.source}, {", ".join(entry.key[1:])}: {error}'
            raise ValueError(msg) from None


@lru_cache(maxsize=1)
def shipped_table() -> TunedTable:
    """What comes with this package."""
    return parse_table(SHIPPED_FILE.read_text(encoding='utf-8'), SHIPPED_FILE.name)


@lru_cache(maxsize=16)
def read_table(path: str | Path) -> TunedTable:
    """The table in a file; a process reads it once.

    Raises
    ------
    ValueError
        There is no such file, or it is no such table; the text says what is wrong with it.
    """
    try:
        text = Path(path).expanduser().read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, 'strerror', None) or 'it is no text'
        msg = f'tuned weights {path} cannot be read: {reason}'
        raise ValueError(msg) from None
    return parse_table(text, str(path))


def parse_table(text: str, source: str) -> TunedTable:
    """The table that ``text`` holds; ``source`` is what errors call it.

    Raises
    ------
    ValueError
        It is no JSON, of another format or version, or an entry is incomplete, doubled or wrong.
    """
    try:
        content = json.loads(text)
    except ValueError as error:
        msg = f'tuned weights {source} are not JSON: {error}'
        raise ValueError(msg) from None
    if not isinstance(content, dict) or content.get('format') != FORMAT:
        msg = f'{source} holds no tuned weights: its "format" must be "{FORMAT}"'
        raise ValueError(msg)
    if content.get('version') != VERSION:
        msg = f'{source} has version {content.get("version")!r}, and this package reads {VERSION}'
        raise ValueError(msg)
    raw = content.get('entries')
    if not isinstance(raw, list):
        msg = f'{source} has no list of "entries"'
        raise ValueError(msg)
    entries = []
    for number, values in enumerate(raw, start=1):
        try:
            entries.append(_entry(values))
        except (ValueError, TypeError, KeyError) as error:
            what = f'{error} is missing' if isinstance(error, KeyError) else error
            msg = f'{source}, entry {number}: {what}'
            raise ValueError(msg) from None
    keys = [entry.key for entry in entries]
    twice = [key for key in keys if keys.count(key) > 1]
    if twice:
        msg = f'{source} has two entries for {", ".join(twice[0])}'
        raise ValueError(msg)
    return TunedTable(tuple(entries), source)


def _entry(values: Mapping[str, Any]) -> TunedEntry:
    if not isinstance(values, dict):
        msg = f'{values!r} is no entry'
        raise TypeError(msg)
    size = values['bin']['size_mm']
    if not isinstance(size, list) or len(size) != 3 or not all(_is_edge(edge) for edge in size):
        msg = f'size_mm of the bin is {size!r}; it must be three whole numbers above 0'
        raise ValueError(msg)
    for name, known in (('profile', PROFILES), ('orientations', ORIENTATION_RULES)):
        if values[name] not in known:
            msg = f'unknown {name} {values[name]!r}: use one of {", ".join(known)}'
            raise ValueError(msg)
    weights = values['weights']
    if not isinstance(weights, dict) or not weights:
        msg = f'weights are {weights!r}; they must be numbers by name'
        raise ValueError(msg)
    return TunedEntry(
        algorithm=str(values['algorithm']),
        bin_name=str(values['bin']['name']),
        bin_size_mm=(size[0], size[1], size[2]),
        profile=values['profile'],
        orientations=values['orientations'],
        weights=tuple((name, _weight(name, value)) for name, value in weights.items()),
        made=values.get('made', {}),
    )


def _is_edge(edge: object) -> bool:
    return isinstance(edge, int) and not isinstance(edge, bool) and edge > 0


def _weight(name: str, value: object) -> float | bool:
    if not isinstance(value, (bool, int, float)):
        msg = f'weight {name} is {value!r}; it must be a number'
        raise TypeError(msg)
    if not math.isfinite(value) or abs(value) > LARGEST:
        msg = f'weight {name} is {value}; it must be a number from -{LARGEST:g} to {LARGEST:g}'
        raise ValueError(msg)
    return value


def table_text(table: TunedTable) -> str:
    """``table`` as :func:`parse_table` reads it."""
    entries = [
        {
            'algorithm': entry.algorithm,
            'bin': {'name': entry.bin_name, 'size_mm': list(entry.bin_size_mm)},
            'profile': entry.profile,
            'orientations': entry.orientations,
            'weights': dict(entry.weights),
            'made': dict(entry.made),
        }
        for entry in table.entries
    ]
    content = {'format': FORMAT, 'version': VERSION, 'entries': entries}
    return json.dumps(content, indent=2, allow_nan=False) + '\n'


def write_table(table: TunedTable, path: Path) -> None:
    """Write the file so that it is never half there."""
    draft = path.with_name(path.name + '.part')
    draft.write_text(table_text(table), encoding='utf-8')
    os.replace(draft, path)
