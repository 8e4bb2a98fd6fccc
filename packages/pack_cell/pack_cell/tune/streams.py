"""Streams of boxes to tune on, and others to check on."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import replace
from itertools import count

from conveyor_sim.streams import Reading, open_source
from conveyor_sim.streams.repeating import ListedBoxes
from pack_cell.bench.streams import measured
from pack_cell.tune.values import CHECK, TuneSettings
from pack_msgs_py.values import Box

#: Of a list in its order, the share at whose start training streams begin; others begin behind it.
TRAINING_SHARE = 2 / 3
_MAX_SEED = 2**31 - 1


def stream_boxes(settings: TuneSettings, part: str, number: int) -> tuple[Box, ...]:
    """The boxes of stream ``number`` of ``part``, as measured; the same whenever it is asked for.

    A list is taken in its order from some place on, and begins again at its end; all else is drawn
    or made anew.

    Raises
    ------
    BoxFileError
        Its source cannot be used.
    """
    rng = random.Random(f'{settings.seed}/{part}/{number}')
    choice = settings.boxes[number % len(settings.boxes)]
    seed = rng.randint(1, _MAX_SEED)
    boxes: list[Box] = []
    volume, wanted = 0.0, settings.stream_bins * settings.bin_spec.volume_mm3
    for box in _endless(choice, settings.reading, seed, rng, in_training=part != CHECK):
        if volume >= wanted:
            break
        boxes.append(replace(box, id=f'{len(boxes) + 1}'))
        volume += box.volume_mm3
    return measured(tuple(boxes), settings.scan_sigma_mm, seed)


def _endless(
    choice: str, reading: Reading, seed: int, rng: random.Random, *, in_training: bool
) -> Iterator[Box]:
    source = open_source(choice, reading=reading)
    if isinstance(source, ListedBoxes):
        listed = [entry for entry in source.turn(0) if isinstance(entry, Box)]
        if not listed:
            msg = f'box file {choice} holds no usable box'
            raise ValueError(msg)
        border = round(TRAINING_SHARE * len(listed))
        first = rng.randrange(border) if in_training else rng.randrange(border, len(listed))
        for index in count(first):
            yield listed[index % len(listed)]
    source = open_source(choice, seed, reading)
    for turn in count():
        for entry in source.turn(turn):
            if isinstance(entry, Box):
                yield entry
