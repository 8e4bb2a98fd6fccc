"""Words of sentences that depend on a number."""

from __future__ import annotations


def how_many(number: int, thing: str, things: str = '') -> str:
    """``1 box``, ``3 boxes``; ``things`` where the plural has neither ``s`` nor ``es``.

    >>> how_many(1, 'box'), how_many(3, 'box'), how_many(0, 'bin')
    ('1 box', '3 boxes', '0 bins')
    >>> how_many(2, 'try', 'tries')
    '2 tries'
    """
    if number == 1:
        return f'1 {thing}'
    ending = 'es' if thing.endswith(('s', 'x', 'ch', 'sh')) else 's'
    return f'{number} {things or thing + ending}'
