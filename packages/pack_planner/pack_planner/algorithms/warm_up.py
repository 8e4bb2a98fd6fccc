"""Compile or load what an algorithm uses, so that no decision does."""

from __future__ import annotations

from functools import lru_cache

from pack_msgs_py.profiles import Profile
from pack_msgs_py.validator import with_box
from pack_msgs_py.values import Bin, BinSpec, Box
from pack_planner.algorithms import Problem, find_algorithm
from pack_planner.algorithms.mpack import warm_up as warm_up_search
from pack_planner.engine import Engine


@lru_cache(maxsize=128)
def warm_up(algorithm: str, profile: Profile, backend: str = 'search') -> None:
    """Let ``algorithm`` decide on a few small boxes; once per process, profile and backend.

    Raises
    ------
    ValueError
        There is no such algorithm.
    """
    decide = find_algorithm(algorithm)
    engine = Engine(profile)
    boxes = tuple(
        Box(f'warm-up {i}', (200.0 - i, 100.0, 80.0), max_top_load_n=1e4) for i in range(4)
    )
    if algorithm == 'mpack':
        warm_up_search(engine)
    target = Bin('warm-up', 1, BinSpec('warm-up', (400, 300, 300)))
    for look_ahead in (1, 1, 3):
        left = tuple(box for box in boxes if box not in [one.box for one in target.boxes])
        models = (engine.model(target),)
        problem = Problem(engine, left[:look_ahead], models, backend=backend)
        choice = decide(problem)
        if choice is not None:
            target = with_box(target, choice.candidate.placed)
