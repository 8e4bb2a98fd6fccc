"""Orders in the JSON of BED-BPP, and plain JSON lists of boxes.

BED-BPP (Kagerer et al., International Journal of Robotics Research 42(11), 2023): an object from
order id to ``{"properties": {...}, "item_sequence": {"1": {"article", "id", "product_group",
"length/mm", "width/mm", "height/mm", "weight/kg", "sequence"}, ...}}``. Its ``id`` names the
article, so a box is called after its order and its place in it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from conveyor_sim.streams.box_records import SIZE_COLUMNS, BoxFileError, FileRow


def json_rows(text: str, file: str) -> Iterator[FileRow]:
    """Each item of each order in its sequence, or each object of a plain list.

    Raises
    ------
    BoxFileError
        The text is not JSON, holds a key twice, or has none of the known shapes.
    """
    try:
        data = json.loads(text, object_pairs_hook=_unique)
    except _TwiceError as error:
        msg = f'box file {file} has the key {error} twice in one object'
        raise BoxFileError(msg) from None
    except (ValueError, RecursionError) as error:
        msg = f'box file {file} is not JSON: {error}'
        raise BoxFileError(msg) from None
    if isinstance(data, list):
        return _rows_of_list(data, file)
    if isinstance(data, dict) and 'item_sequence' in data:
        return _rows_of_orders({'order': data}, file)
    if isinstance(data, dict) and data:
        return _rows_of_orders(data, file)
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


def _rows_of_list(items: list[Any], file: str) -> Iterator[FileRow]:
    if not any(isinstance(item, dict) and _has_sizes(item) for item in items):
        msg = f'box file {file} is a list without any box that has length_mm, width_mm, height_mm'
        raise BoxFileError(msg)
    for number, item in enumerate(items, start=1):
        yield _row(f'item {number}', item, '')


def _has_sizes(item: dict[str, Any]) -> bool:
    return all(any(name in item for name in names) for names in SIZE_COLUMNS)


def _rows_of_orders(orders: dict[str, Any], file: str) -> Iterator[FileRow]:
    if not any(isinstance(order, dict) and 'item_sequence' in order for order in orders.values()):
        msg = f'box file {file} holds no order with an "item_sequence" (the format of BED-BPP)'
        raise BoxFileError(msg)
    for order_id, order in orders.items():
        items = order.get('item_sequence') if isinstance(order, dict) else None
        if not isinstance(items, dict):
            text = f'has no item_sequence: {str(order)[:60]!r}'
            yield FileRow(0, f'order {order_id!r}', {}, named=order_id, damage=text)
            continue
        for key in sorted(items, key=_sequence_key):
            place = f'order {order_id!r}, item {key!r}'
            yield _row(place, items[key], f'{order_id}-{key}', order_id)


def _sequence_key(key: str) -> tuple[int, str]:
    return (int(key), '') if key.isdecimal() else (2**63, key)


def _row(place: str, item: Any, named: str, order_id: str = '') -> FileRow:  # noqa: ANN401
    if not isinstance(item, dict):
        return FileRow(0, place, {}, named=named, damage=f'is not an object: {str(item)[:60]!r}')
    values = {str(key): '' if cell is None else str(cell).strip() for key, cell in item.items()}
    if order_id:
        values['order_id'] = order_id
        # BED-BPP's id is the article's; two of the same article are two boxes.
        values['article_id'] = values.pop('id', '')
    return FileRow(0, place, values, named=named)
