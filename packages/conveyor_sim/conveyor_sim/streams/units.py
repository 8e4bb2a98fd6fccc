"""Units of box lists: words in a header, in a cell or in an option, and what one is in ours."""

from __future__ import annotations

#: Standard gravity, m/s2: what a load in kilograms weighs in newtons.
G = 9.80665

LENGTH, WEIGHT, LOAD = 'length', 'weight', 'load'

#: For each kind: the unit, how large it is in ours (mm, kg, N), and the words for it.
_UNITS: dict[str, tuple[tuple[str, float, str], ...]] = {
    LENGTH: (
        ('mm', 1.0, 'mm мм millimeter millimeters millimetre millimetres'),
        ('cm', 10.0, 'cm см centimeter centimeters centimetre centimetres zentimeter centimetros'),
        ('dm', 100.0, 'dm decimeter decimetre dezimeter'),
        ('m', 1000.0, 'm м meter meters metre metres metros'),
        ('in', 25.4, 'in inch inches zoll pouce pouces pulgada pulgadas " ″'),
        ('ft', 304.8, 'ft foot feet'),
    ),
    WEIGHT: (
        ('kg', 1.0, 'kg kgs кг kilo kilos kilogram kilograms kilogramm kilogrammes kilogramme'),
        ('g', 0.001, 'g г gr gram grams gramm gramme grammes gramos'),
        ('lb', 0.45359237, 'lb lbs pound pounds'),
        ('oz', 0.028349523125, 'oz ounce ounces'),
        ('t', 1000.0, 't ton tons tonne tonnes tonnen'),
    ),
    LOAD: (
        ('N', 1.0, 'n newton newtons'),
        ('kg', G, 'kg kgs kilogram kilograms'),
        ('lb', 0.45359237 * G, 'lb lbs pound pounds'),
    ),
}

#: Words behind a number of boxes.
PIECES = frozenset(
    ('stk', 'st', 'stück', 'stueck', 'pcs', 'pc', 'piece', 'pieces', 'ea', 'each', 'x', 'ct', 'ctn',
     'ctns', 'carton', 'cartons', 'box', 'boxes', 'karton', 'kartons', 'colli', 'kolli', 'pz',
     'pce', 'szt', 'шт', 'uds', 'ud', '个', '個', '箱', '件', '개')
)  # fmt: skip

#: Every word: for each kind, the unit that it means.
UNIT_WORDS: dict[str, dict[str, str]] = {
    kind: {word: unit for unit, _, words in units for word in words.split()}
    for kind, units in _UNITS.items()
}
_IN_OURS = {kind: {unit: size for unit, size, _ in units} for kind, units in _UNITS.items()}


def unit_of(word: str, kind: str) -> str:
    """The unit of ``kind`` that ``word`` means; empty when it means none."""
    return UNIT_WORDS.get(kind, {}).get(word.casefold(), '')


def in_ours(unit: str, kind: str) -> float:
    """How many millimetres, kilograms or newtons one ``unit`` is."""
    return _IN_OURS[kind][unit]


def known_units(kind: str) -> str:
    """The units of ``kind``, for messages."""
    return ', '.join(unit for unit, _, _ in _UNITS[kind])
