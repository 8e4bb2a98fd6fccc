"""Orders in the JSON of BED-BPP, and JSON lists of boxes: one array, or an object in each line.

BED-BPP (Kagerer et al., International Journal of Robotics Research 42(11), 2023): an object from
order id to ``{"properties": {...}, "item_sequence": {"1": {"article", "id", "product_group",
"length/mm", "width/mm", "height/mm", "weight/kg", "sequence"}, ...}}``. Its ``id`` names the
article, so a box is called after its order and its place in it. The sequence may be a list too.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

from conveyor_sim.streams.box_records import BoxFileError
from conveyor_sim.streams.columns import has_sizes
from conveyor_sim.streams.number_columns import TypedNumber
from conveyor_sim.streams.reading import Reading
from conveyor_sim.streams.table import BoxTable, TableRow
from pack_msgs_py.wording import how_many

#: Keys under which an object holds a list of boxes.
_LISTS = ('boxes', 'items', 'cartons', 'packages', 'parcels')


def json_table(text: str, file: str, reading: Reading) -> BoxTable:
    """Each item of each order in its sequence, or each object of a list.

    Raises
    ------
    BoxFileError
        The text is not JSON, holds a key twice, or has none of the known shapes.
    """
    data = _loaded(text, file)
    if isinstance(data, dict):
        for key in _LISTS:
            if isinstance(data.get(key), list):
                others = ', '.join(repr(name) for name in data if name != key)
                notes = (f'not used: {others} beside {key!r}',) if others else ()
                return _table_of_list(data[key], file, reading, notes)
    if isinstance(data, list):
        return _table_of_list(data, file, reading)
    if isinstance(data, dict) and 'item_sequence' in data:
        return _table_of_orders({'order': data}, file)
    if isinstance(data, dict) and data:
        return _table_of_orders(data, file)
    msg = f'box file {file} holds no orders: an object of orders or a list of boxes is needed'
    raise BoxFileError(msg)


class _TwiceError(Exception):
    """A JSON object names a key twice; json.loads would keep one and lose the other silently."""


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    values = dict(pairs)
    if len(values) != len(pairs):
        keys = [key for key, _ in pairs]
        raise _TwiceError(repr(next(key for key in keys if keys.count(key) > 1)))
    return values


def _loaded(text: str, file: str) -> Any:  # noqa: ANN401 - whatever the file holds
    """The value of the text, or the list of the values of its lines."""
    try:
        return json.loads(text, object_pairs_hook=_unique)
    except _TwiceError as error:
        msg = f'box file {file} has the key {error} twice in one object'
        raise BoxFileError(msg) from None
    except (ValueError, RecursionError) as error:
        lines = [line for line in text.splitlines() if line.strip()]
        if len(lines) < 2 or not all(line.strip()[-1:] == '}' for line in lines[:2]):
            msg = f'box file {file} is not JSON: {error}'
            raise BoxFileError(msg) from None
    items: list[Any] = []
    for number, line in enumerate(lines, start=1):
        try:
            items.append(json.loads(line, object_pairs_hook=_unique))
        except (_TwiceError, ValueError, RecursionError) as error:
            items.append(f'line {number} is not JSON: {error}')
    return items


def _table_of_list(
    items: list[Any], file: str, reading: Reading, notes: tuple[str, ...] = ()
) -> BoxTable:
    rows = tuple(_row(f'item {number}', item, '') for number, item in enumerate(items, start=1))
    headers = _headers(rows)
    if not has_sizes(headers, reading):
        found = ', '.join(headers[:12]) or 'no objects'
        msg = (
            f'box file {file} is a list without any box that has length_mm, width_mm, height_mm, '
            f'or what these are called elsewhere; found {found}'
        )
        raise BoxFileError(msg)
    return BoxTable(headers, rows, notes, points_by_format=True)


def _table_of_orders(orders: dict[str, Any], file: str) -> BoxTable:
    if not any(isinstance(order, dict) and 'item_sequence' in order for order in orders.values()):
        msg = f'box file {file} holds no order with an "item_sequence" (the format of BED-BPP)'
        raise BoxFileError(msg)
    rows = tuple(_rows_of_orders(orders))
    return BoxTable(_headers(rows), rows, tuple(_property_notes(orders)), points_by_format=True)


def _rows_of_orders(orders: dict[str, Any]) -> Iterator[TableRow]:
    for order_id, order in orders.items():
        items = order.get('item_sequence') if isinstance(order, dict) else None
        if isinstance(items, list):
            items = {str(place): item for place, item in enumerate(items, start=1)}
        if not isinstance(items, dict):
            text = f'has no item_sequence: {str(order)[:60]!r}'
            yield TableRow(0, f'order {order_id!r}', {}, named=order_id, damage=text)
            continue
        for key in sorted(items, key=_sequence_key):
            place = f'order {order_id!r}, item {key!r}'
            yield _row(place, items[key], f'{order_id}-{key}', order_id)


def _property_notes(orders: dict[str, Any]) -> Iterator[str]:
    """The properties of orders: a kind of bin among them is for `--bin` to say."""
    seen: dict[str, Counter[str]] = {}
    for order in orders.values():
        properties = order.get('properties') if isinstance(order, dict) else None
        for key, value in (properties if isinstance(properties, dict) else {}).items():
            seen.setdefault(str(key), Counter())[str(value)] += 1
    for key, values in seen.items():
        shown = ', '.join(
            f'{value[:40]} ({how_many(n, "order")})' for value, n in values.most_common(4)
        )
        hint = '; --bin says which bin' if key == 'target' else ''
        yield f'not used: property {key} of the orders: {shown}{hint}'


def _headers(rows: Iterable[TableRow]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for row in rows for name in row.cells))


def _sequence_key(key: str) -> tuple[int, str]:
    return (int(key), '') if key.isdecimal() else (2**63, key)


def _row(place: str, item: Any, named: str, order_id: str = '') -> TableRow:  # noqa: ANN401
    if not isinstance(item, dict):
        return TableRow(0, place, {}, named=named, damage=f'is not an object: {str(item)[:60]!r}')
    cells = dict(_cells(item))
    if order_id:
        cells['order_id'] = order_id
        if 'id' in cells:
            # BED-BPP's id is the article's; two of the same article are two boxes.
            cells['article_id'] = cells.pop('id')
    return TableRow(0, place, cells, named=named)


def _cells(item: dict[str, Any], above: str = '') -> Iterator[tuple[str, str]]:
    """The values of an object as texts; those of an object in it are called after both."""
    unit = item.get('unit', item.get('units')) if above else None
    for key, value in item.items():
        name = f'{above}{key}'
        if isinstance(value, dict):
            yield from _cells(value, f'{name} ')
        elif isinstance(unit, str) and value == unit:
            continue
        elif isinstance(value, list) and len(value) == 3 and all(map(_is_number, value)):
            yield name, TypedNumber(' x '.join(map(str, value)))
        elif isinstance(unit, str) and _is_number(value):
            yield name.removesuffix(' value'), TypedNumber(f'{value} {unit}')
        elif _is_number(value):
            yield name, TypedNumber(value)
        else:
            yield name, '' if value is None else str(value).strip()


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
