"""No decision waits for a compiler: after the warm-up every compiled function is there."""

from __future__ import annotations

import subprocess
import sys

import pytest

from pack_msgs_py.profiles import PROFILES
from pack_planner.algorithms.warm_up import warm_up

_PROBE = """
import gc, random, sys
from dataclasses import replace
from numba.core.dispatcher import Dispatcher
from pack_msgs_py.profiles import find_profile
from pack_msgs_py.values import Bin, BinSpec, Box
from pack_planner.algorithms import Problem, find_algorithm
from pack_planner.algorithms.warm_up import warm_up
from pack_planner.engine import Engine

def compiled():
    return {(d.py_func.__module__, d.py_func.__name__): len(d.signatures)
            for d in gc.get_objects() if isinstance(d, Dispatcher)}

names, profile = sys.argv[1].split(','), find_profile(sys.argv[2])
engine = Engine(profile)
for name in names:
    warm_up(name, profile)
before = compiled()
rng = random.Random(1)
for name in names:
    spec = BinSpec('60x40x40', (600, 400, 400))
    bins = [Bin(f'{name}-{i}', i, spec) for i in (1, 2)]
    sizes = [[float(rng.randrange(80, 260, 10)) for _ in range(3)] for _ in range(30)]
    boxes = [Box(f'{name}{i}', tuple(size), 2.0, max_top_load_n=rng.choice((None, 90.0)))
             for i, size in enumerate(sizes)]
    boxes = [box for box in boxes if engine.fits_empty_bin(box, spec)]
    while boxes:
        models = tuple(engine.model(target) for target in bins)
        choice = find_algorithm(name)(Problem(engine, tuple(boxes[:4]), models, node_limit=3000))
        if choice is None:
            break
        placed, index = choice.candidate.placed, choice.candidate.bin_index
        bins[index] = replace(bins[index], boxes=(*bins[index].boxes, placed),
                              revision=bins[index].revision + 1)
        boxes.remove(placed.box)
print({key: count for key, count in compiled().items() if count != before.get(key, 0)})
"""


@pytest.mark.slow
@pytest.mark.parametrize('profile', PROFILES)
def test_nothing_is_compiled_in_a_decision(profile):
    names = (
        'mpack_lite,mpack,rollout,foresight,o_first_fit,o_jampack,walle,heightmap_min,'
        'best_short_side_fit'
    )
    probe = subprocess.run(
        [sys.executable, '-c', _PROBE, names, profile], capture_output=True, text=True, check=True
    )
    assert probe.stdout.strip() == '{}'


def test_an_unknown_algorithm_is_refused():
    with pytest.raises(ValueError, match="unknown algorithm 'magic': use one of mpack_lite"):
        warm_up('magic', PROFILES['paper'])
