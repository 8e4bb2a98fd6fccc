"""MPackLite (Ojha et al., section III-C): OPack with the exact argmin of eq. (1) for each box."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from pack_msgs_py.codes import PlacementStatus
from pack_msgs_py.values import Box
from pack_planner.algorithms.base import Choice, Problem
from pack_planner.algorithms.opack import opack
from pack_planner.algorithms.registry import algorithm
from pack_planner.engine import BinModel, Candidate, Engine
from pack_planner.engine.engine import Forbidden
from pack_planner.joint.by_solver.solvers import solve_joint


def least_objective(
    engine: Engine, box: Box, bins: Sequence[BinModel], forbidden: Forbidden
) -> Candidate | None:
    """PACKRULE of MPackLite: the placement that minimises eq. (1)."""
    return engine.best_placement(box, bins, forbidden)


def touching_objective(
    engine: Engine, box: Box, bins: Sequence[BinModel], forbidden: Forbidden
) -> Candidate | None:
    """The same under the constraints for efficient packing (section III-A.1)."""
    return engine.best_placement(box, bins, forbidden, cep=True)


@algorithm('mpack_lite', backends=True)
def mpack_lite(problem: Problem) -> Choice | None:
    """Choose by MPackLite; every virtual step is a proven optimum.

    With a backend of OR-Tools, a step that the budget cuts short takes our own engine's placement,
    and the status says so. Which of several equal placements comes out
    is up to the backend.
    """
    if problem.backend == 'search':
        return opack(problem, touching_objective if problem.cep else least_objective)
    deadline = time.monotonic() + problem.budget_s
    all_proven = True

    def by_backend(
        engine: Engine, box: Box, bins: Sequence[BinModel], forbidden: Forbidden
    ) -> Candidate | None:
        nonlocal all_proven
        result = solve_joint(
            engine, (box,), bins, forbidden, None, problem.backend, deadline - time.monotonic(),
            cep=problem.cep,
        )  # fmt: skip
        if result.candidates is not None and result.proven:
            return result.candidates[0]
        if result.proven:
            return None
        all_proven = False
        return engine.best_placement(box, bins, forbidden, cep=problem.cep)

    choice = opack(problem, by_backend)
    if choice is None or all_proven:
        return choice
    return replace(choice, status=PlacementStatus.BUDGET)
