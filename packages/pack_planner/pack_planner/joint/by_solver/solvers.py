"""The joint problem by CP-SAT or by a MILP solver, both of OR-Tools."""

from __future__ import annotations

import importlib.util
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from pack_msgs_py.values import Box
from pack_planner.engine import BinModel, Candidate, Engine
from pack_planner.engine.engine import Forbidden
from pack_planner.joint.by_solver.formulation import Formulation
from pack_planner.joint.by_solver.model import JointModel
from pack_planner.joint.solution import JointResult, joint_violations


@dataclass(frozen=True)
class SolverAnswer:
    """What a solver found: values of all variables (``None`` for none) and a lower bound."""

    values: tuple[int, ...] | None
    bound: float


Solver = Callable[[Formulation, float], SolverAnswer]


def solve_cp_sat(formulation: Formulation, seconds: float) -> SolverAnswer:
    """Minimise by CP-SAT within ``seconds``; one worker and a fixed seed, so repeatable."""
    from ortools.sat.python import cp_model

    f = formulation
    model = cp_model.CpModel()
    var = [model.new_int_var(low, high, '') for low, high in zip(f.lows, f.highs, strict=True)]
    for constraint in f.constraints:
        terms = cp_model.LinearExpr.weighted_sum(
            [var[number] for _, number in constraint.terms],
            [factor for factor, _ in constraint.terms],
        )
        added = model.add(terms <= constraint.limit)
        if constraint.when:
            added.only_enforce_if([var[number] for number in constraint.when])
    for number, value in f.hints.items():
        model.add_hint(var[number], value)
    # in whole numbers where tenths are exact: its reasoning is about these
    scale = 10.0
    costs = [scale * cost for cost in f.costs.values()]
    if all(abs(cost - round(cost)) < 1e-9 for cost in costs):
        costs = [round(cost) for cost in costs]
    model.minimize(cp_model.LinearExpr.weighted_sum([var[n] for n in f.costs], costs))
    solver = cp_model.CpSolver()
    solver.parameters.max_time_in_seconds = max(seconds, 1e-3)
    solver.parameters.num_workers = 1
    solver.parameters.random_seed = 0
    # linear relaxations of "beside or above" say little and take a third of the time
    solver.parameters.linearization_level = 0
    status = solver.solve(model)
    if status == cp_model.INFEASIBLE:
        return SolverAnswer(None, math.inf)
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        return SolverAnswer(None, 0.0)
    values = tuple(solver.value(variable) for variable in var)
    bound = solver.objective_value if status == cp_model.OPTIMAL else solver.best_objective_bound
    return SolverAnswer(values, bound / scale)


def solve_milp(formulation: Formulation, seconds: float) -> SolverAnswer:
    """Minimise by SCIP within ``seconds``, conditions as constants that switch constraints off."""
    from ortools.linear_solver import pywraplp

    f = formulation
    solver = pywraplp.Solver.CreateSolver('SCIP')
    var = [solver.IntVar(low, high, '') for low, high in zip(f.lows, f.highs, strict=True)]
    for constraint in f.constraints:
        _, most = f.range_of(constraint.terms)
        slack = max(0, most - constraint.limit)
        limit = constraint.limit + slack * len(constraint.when)
        row = solver.Constraint(-solver.infinity(), float(limit))
        factors: dict[int, float] = {}
        for factor, number in constraint.terms:
            factors[number] = factors.get(number, 0.0) + factor
        for number in constraint.when:
            factors[number] = factors.get(number, 0.0) + slack
        for number, value in factors.items():
            row.SetCoefficient(var[number], value)
    for number, cost in f.costs.items():
        solver.Objective().SetCoefficient(var[number], cost)
    solver.Objective().SetMinimization()
    if f.hints:
        solver.SetHint([var[n] for n in f.hints], [float(v) for v in f.hints.values()])
    solver.SetTimeLimit(max(1, int(seconds * 1000)))
    status = solver.Solve()
    if status == pywraplp.Solver.INFEASIBLE:
        return SolverAnswer(None, math.inf)
    if status not in (pywraplp.Solver.OPTIMAL, pywraplp.Solver.FEASIBLE):
        return SolverAnswer(None, 0.0)
    values = tuple(round(variable.solution_value()) for variable in var)
    optimal = status == pywraplp.Solver.OPTIMAL
    objective = float(solver.Objective().Value())
    return SolverAnswer(values, objective if optimal else float(solver.Objective().BestBound()))


def cp_sat_installed() -> bool:
    """Whether OR-Tools is there; the planner works without it."""
    return importlib.util.find_spec('ortools') is not None


SOLVERS: dict[str, Solver] = {'cp_sat': solve_cp_sat, 'milp': solve_milp}


def solve_joint(
    engine: Engine, boxes: Sequence[Box], bins: Sequence[BinModel], forbidden: Forbidden,
    incumbent: Sequence[Candidate] | None, backend: str, budget_s: float, *, cep: bool = False,
) -> JointResult:  # fmt: skip
    """The joint optimum by ``backend``, a key of :data:`SOLVERS`, within ``budget_s`` seconds.

    Never worse than ``incumbent``. With ``cep`` each box touches something along x and along y. An
    arrangement that breaks a rule which the constraints do not state is ruled out, and the solver
    asked again.
    """
    started = time.monotonic()
    objective = (
        math.inf if incumbent is None else sum(candidate.objective for candidate in incumbent)
    )
    known = JointResult(None if incumbent is None else tuple(incumbent), objective, 0.0)
    model = JointModel(engine, boxes, bins, forbidden, cep)
    if not model.possible:
        return replace(known, lower_bound=objective)
    if incumbent is not None:
        model.hint(incumbent)
    lower, rounds = 0.0, 0
    while True:
        left = budget_s - (time.monotonic() - started)
        if left <= 0:
            return replace(known, lower_bound=min(lower, known.objective), nodes=rounds)
        answer = SOLVERS[backend](model.formulation, left)
        rounds += 1
        lower = max(lower, answer.bound)
        if answer.values is None:
            return replace(known, lower_bound=min(lower, known.objective), nodes=rounds)
        solution = model.read(answer.values)
        if not joint_violations(solution, bins, engine):
            objective = sum(candidate.objective for candidate in solution)
            if objective < known.objective - 1e-6:
                known = JointResult(solution, objective, 0.0)
            return replace(known, lower_bound=min(lower, known.objective), nodes=rounds)
        model.rule_out(_offenders(solution, bins, engine))


def _offenders(
    solution: tuple[Candidate, ...], bins: Sequence[BinModel], engine: Engine
) -> tuple[Candidate, ...]:
    """The first box that breaks a rule, and the boxes of its bin before it.

    Only what lies under it decides about support; loads may come from anywhere in the bin.
    """
    for last in range(1, len(solution) + 1):
        if joint_violations(solution[:last], bins, engine):
            index = solution[last - 1].bin_index
            return tuple(c for c in solution[:last] if c.bin_index == index)
    return solution
