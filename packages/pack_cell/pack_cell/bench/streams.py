"""Collections of boxes: cut from bins (SYN), drawn from a list (industrial), or a file's own."""

from __future__ import annotations

import math
import random
from dataclasses import replace

from conveyor_sim.scanning.scanner import Scanner, ScannerNoise
from conveyor_sim.streams.box_records import DEFAULT_DENSITY_KG_PER_MM3
from conveyor_sim.streams.syn import cut_bins
from pack_cell.bench.values import BenchSettings, Case
from pack_msgs_py.values import BinSpec, Box

#: Bins whose volume a drawn collection has (Ojha et al., section IV).
INDUSTRIAL_BINS = 4


def collection(case: Case, settings: BenchSettings, number: int) -> tuple[Box, ...]:
    """The boxes of collection ``number``, from 0, in the order of their arrival.

    Equal for all algorithms and look-aheads, so that these are compared on the same boxes. Each has
    one of ``settings.destinations``, if there are any; whatever the file says then does not count.
    """
    boxes = measured(_boxes(case, settings, number), settings.scan_sigma_mm, number)
    count = settings.destinations
    if not count:
        return boxes
    rng = random.Random(f'{settings.seed}/{case.bin_spec.name}/{number}/destinations')
    return tuple(replace(box, destination=destination(rng.randrange(count))) for box in boxes)


def measured(boxes: tuple[Box, ...], sigma_mm: float, seed: int) -> tuple[Box, ...]:
    """``boxes`` as a scanner says they are whose edges are off by ``sigma_mm``."""
    if not sigma_mm:
        return boxes
    scanner = Scanner(ScannerNoise(size_mm=sigma_mm), seed)
    return tuple(scanner.measure(box, ordinal) for ordinal, box in enumerate(boxes))


def destination(number: int) -> str:
    """Name of destination ``number``, from 0."""
    return f'destination {number + 1}'


def _boxes(case: Case, settings: BenchSettings, number: int) -> tuple[Box, ...]:
    source = case.source
    rng = random.Random(f'{settings.seed}/{case.bin_spec.name}/{number}')
    if not source.boxes:
        return cut_collection(case.bin_spec, settings.boxes_per_bin, rng)
    if not source.in_order:
        return drawn_collection(case.bin_spec, source.boxes, rng)
    boxes = list(source.boxes)
    if source.shuffle is not None:
        random.Random(f'{source.shuffle}/{number}').shuffle(boxes)
    return tuple(boxes)


def cut_collection(spec: BinSpec, pieces: int, rng: random.Random) -> tuple[Box, ...]:
    """Ten bins, each cut into ``pieces`` boxes of whole centimetres, and all of them shuffled."""
    return tuple(
        Box(f'syn-{number}', size, weight_kg=math.prod(size) * DEFAULT_DENSITY_KG_PER_MM3)
        for number, size in enumerate(cut_bins(spec, pieces, rng), start=1)
    )


def drawn_collection(spec: BinSpec, boxes: tuple[Box, ...], rng: random.Random) -> tuple[Box, ...]:
    """Boxes drawn with replacement until their true volume fills four bins; each gets a new id."""
    drawn: list[Box] = []
    volume, wanted = 0.0, INDUSTRIAL_BINS * spec.volume_mm3
    while volume < wanted:
        box = rng.choice(boxes)
        drawn.append(replace(box, id=f'{box.id}/{len(drawn) + 1}'))
        volume += box.volume_mm3
    return tuple(drawn)
