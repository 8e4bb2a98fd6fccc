"""Compile or load what an algorithm uses, so that no decision does."""

from __future__ import annotations

from functools import lru_cache

from pack_msgs_py.profiles import Profile
from pack_msgs_py.validator import with_box
from pack_msgs_py.values import Bin, BinSpec, Box
from pack_planner.algorithms import Algorithm, Problem, find_algorithm
from pack_planner.engine import Engine


@lru_cache(maxsize=128)
def warm_up(which: str | Algorithm, profile: Profile, backend: str = 'search') -> None:
    """Let an algorithm decide on a few small boxes; once per process, profile and backend.

    Raises
    ------
    ValueError
        There is no such algorithm.
    """
    algorithm = find_algorithm(which)
    engine = Engine(profile)
    boxes = tuple(
        Box(f'warm-up {i}', (200.0 - i, 100.0, 80.0), max_top_load_n=1e4) for i in range(4)
    )
    if algorithm.prepare is not None:
        algorithm.prepare(engine)
    target = Bin('warm-up', 1, BinSpec('warm-up', (400, 300, 300)))
    for look_ahead in (1, 1, 3):
        left = tuple(box for box in boxes if box not in [placed.box for placed in target.boxes])
        models = (engine.model(target),)
        problem = Problem(engine, left[:look_ahead], models, backend=backend)
        choice = algorithm(problem)
        if choice is not None:
            target = with_box(target, choice.candidate.placed)
