"""How a box list is to be read, where it does not say so itself: options, and a file beside it.

``orders.csv.yaml`` beside ``orders.csv`` may hold ``units``, ``decimal`` and ``order_by`` as the
options are written, and ``columns``: a mapping from what a column means to its header.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import yaml

from conveyor_sim.streams.box_records import BoxFileError
from conveyor_sim.streams.column_names import MEANINGS
from conveyor_sim.streams.number_columns import COMMA, POINT
from conveyor_sim.streams.units import LENGTH, WEIGHT, known_units, unit_of

_SIDECAR_KEYS = ('units', 'decimal', 'order_by', 'columns')


@dataclass(frozen=True)
class Reading:
    """What is said of a box list besides itself; empty for what the list has to say.

    Attributes
    ----------
    units : of lengths and weights that have none, with commas: ``cm,kg``, ``in,lb`` or ``g``.
    decimal : mark of all numbers, ``point`` or ``comma``.
    order_by : header of the column by whose values boxes keep apart, in bins of their own.
    columns : header of the column for each meaning that is named.
    """

    units: str = ''
    decimal: str = ''
    order_by: str = ''
    columns: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for word in self._words():
            if not (unit_of(word, LENGTH) or unit_of(word, WEIGHT)):
                msg = (
                    f'unit {word!r} is unknown: use one of {known_units(LENGTH)} for lengths and '
                    f'{known_units(WEIGHT)} for weights, such as cm,kg'
                )
                raise BoxFileError(msg)
        if self.decimal not in ('', POINT, COMMA):
            msg = f'decimal {self.decimal!r} is unknown: use {POINT} or {COMMA}'
            raise BoxFileError(msg)
        unknown = set(self.columns) - set(MEANINGS)
        if unknown:
            msg = f'columns {sorted(unknown)} mean nothing here: use {", ".join(MEANINGS)}'
            raise BoxFileError(msg)

    def unit(self, kind: str) -> str:
        """The unit of ``kind`` that was named; empty when none was."""
        return next((unit for word in self._words() if (unit := unit_of(word, kind))), '')

    def beside(self, file: Path) -> Reading:
        """This, with what the file beside ``file`` says where this says nothing.

        Raises
        ------
        BoxFileError
            The file beside it cannot be used.
        """
        path = file.with_name(file.name + '.yaml')
        if not path.is_file():
            return self
        try:
            data = yaml.safe_load(path.read_text(encoding='utf-8-sig')) or {}
        except (OSError, ValueError, yaml.YAMLError) as error:
            msg = f'{path} cannot be read: {" ".join(str(error).split())}'
            raise BoxFileError(msg) from None
        columns = data.get('columns') or {} if isinstance(data, dict) else None
        if not isinstance(columns, dict) or set(data) - set(_SIDECAR_KEYS):
            msg = f'{path} must be a mapping with {", ".join(_SIDECAR_KEYS)}'
            raise BoxFileError(msg)
        try:
            said = Reading(
                str(data.get('units') or ''),
                str(data.get('decimal') or ''),
                str(data.get('order_by') or ''),
                {str(meaning): str(header) for meaning, header in columns.items()},
            )
        except BoxFileError as error:
            msg = f'{path}: {error}'
            raise BoxFileError(msg) from None
        return replace(
            said,
            units=self.units or said.units,
            decimal=self.decimal or said.decimal,
            order_by=self.order_by or said.order_by,
        )

    def _words(self) -> list[str]:
        return [word.strip() for word in self.units.split(',') if word.strip()]
