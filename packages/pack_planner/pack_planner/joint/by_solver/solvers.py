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
from pack_planner.joint.bounds import Reach
from pack_planner.joint.by_solver.formulation import Formulation
from pack_planner.joint.by_solver.model import JointModel
from pack_planner.joint.by_solver.narrowing import Narrowing, alike
from pack_planner.joint.solution import JointResult, joint_violations


@dataclass(frozen=True)
class Answer:
    """What a solver found: values of all variables (``None`` for none) and a lower bound."""

    values: tuple[int, ...] | None
    bound: float


Solver = Callable[[Formulation, float], Answer]


def solve_cp_sat(formulation: Formulation, seconds: float) -> Answer:
    """Minimise by CP-SAT within ``seconds``; one worker and a fixed seed, so repeatable."""
    from ortools.sat.python import cp_model

    f = formulation
    model = cp_model.CpModel()
    var = [model.new_int_var(low, high, '') for low, high in zip(f.lows, f.highs, strict=True)]
    for one in f.constraints:
        terms = cp_model.LinearExpr.weighted_sum(
            [var[number] for _, number in one.terms], [factor for factor, _ in one.terms]
        )
        added = model.add(terms <= one.limit)
        if one.when:
            added.only_enforce_if([var[number] for number in one.when])
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
        return Answer(None, math.inf)
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        return Answer(None, 0.0)
    values = tuple(solver.value(one) for one in var)
    bound = solver.objective_value if status == cp_model.OPTIMAL else solver.best_objective_bound
    return Answer(values, bound / scale)


def solve_milp(formulation: Formulation, seconds: float) -> Answer:
    """Minimise by SCIP within ``seconds``, conditions as constants that switch constraints off."""
    from ortools.linear_solver import pywraplp

    f = formulation
    solver = pywraplp.Solver.CreateSolver('SCIP')
    var = [solver.IntVar(low, high, '') for low, high in zip(f.lows, f.highs, strict=True)]
    for one in f.constraints:
        _, most = f.range_of(one.terms)
        slack = max(0, most - one.limit)
        limit = one.limit + slack * len(one.when)
        row = solver.Constraint(-solver.infinity(), float(limit))
        factors: dict[int, float] = {}
        for factor, number in one.terms:
            factors[number] = factors.get(number, 0.0) + factor
        for number in one.when:
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
        return Answer(None, math.inf)
    if status not in (pywraplp.Solver.OPTIMAL, pywraplp.Solver.FEASIBLE):
        return Answer(None, 0.0)
    values = tuple(round(one.solution_value()) for one in var)
    optimal = status == pywraplp.Solver.OPTIMAL
    objective = float(solver.Objective().Value())
    return Answer(values, objective if optimal else float(solver.Objective().BestBound()))


def cp_sat_installed() -> bool:
    """Whether OR-Tools is there; the planner works without it."""
    return importlib.util.find_spec('ortools') is not None


SOLVERS: dict[str, Solver] = {'cp_sat': solve_cp_sat, 'milp': solve_milp}


def solve_joint(
    engine: Engine, boxes: Sequence[Box], bins: Sequence[BinModel], forbidden: Forbidden,
    incumbent: Sequence[Candidate] | None, backend: str, budget_s: float, *, cep: bool = False,
    reach: Reach | None = None, at_least: float = 0.0,
) -> JointResult:  # fmt: skip
    """The joint optimum by ``backend``, a key of :data:`SOLVERS`, within ``budget_s`` seconds.

    Never worse than ``incumbent``. With ``cep`` each box touches something along x and along y. An
    arrangement that breaks a rule which the constraints do not state is ruled out, and the solver
    asked again. ``reach`` are bounds for that incumbent, ``at_least`` is one for all boxes
    together; without ``reach`` the model is the rules alone, and states the least objective.
    """
    started = time.monotonic()
    objective = math.inf if incumbent is None else sum(one.objective for one in incumbent)
    known = JointResult(None if incumbent is None else tuple(incumbent), objective, 0.0)
    narrowing = None
    if reach is not None:
        pairs = alike(boxes, bins, forbidden)
        narrowing = Narrowing(reach, engine.profile.resolution_mm, engine.weights, pairs)
    model = JointModel(engine, boxes, bins, forbidden, cep, narrowing)
    if not model.possible:
        return replace(known, lower_bound=objective)
    if narrowing is not None and narrowing.grain and incumbent is not None:
        return _bisect(model, narrowing, known, at_least, SOLVERS[backend], started + budget_s)
    if incumbent is not None:
        model.hint(incumbent)
    lower, rounds = at_least, 0
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
            objective = sum(one.objective for one in solution)
            if objective < known.objective - 1e-6:
                known = JointResult(solution, objective, 0.0)
            return replace(known, lower_bound=min(lower, known.objective), nodes=rounds)
        model.rule_out(_offenders(solution, bins, engine))


def _bisect(
    model: JointModel, narrowing: Narrowing, known: JointResult, at_least: float, solver: Solver,
    deadline: float,
) -> JointResult:  # fmt: skip
    """The optimum by asking for any solution of so much or less, again and again.

    That there is none is proven several times sooner than that one is the least. The first question
    is whether anything beats ``known`` at all, which is often the optimum; after that each one
    splits the range between bound and solution nearer to the solution: proofs take longer than
    finds.
    """
    grain, improved, rounds = narrowing.grain, False, 0
    lower = math.ceil((10.0 * at_least - 1e-3) / grain) * grain
    while True:
        most = (math.ceil((10.0 * known.objective - 1e-3) / grain) - 1) * grain
        left = deadline - time.monotonic()
        if lower > most:
            return replace(known, lower_bound=known.objective, nodes=rounds)
        if left <= 0:
            break
        asked = (lower + 3 * most) // 4 // grain * grain if improved else most
        asked = max(asked, lower)
        answer = solver(narrowing.within(model.formulation, model.variables, lower, asked), left)
        rounds += 1
        if answer.values is None:
            if not math.isinf(answer.bound):
                break
            lower = asked + grain
            continue
        improved = True
        solution = model.read(answer.values)
        if joint_violations(solution, model.bins, model.engine):
            model.rule_out(_offenders(solution, model.bins, model.engine))
        else:
            known = JointResult(solution, sum(one.objective for one in solution), 0.0)
    return replace(known, lower_bound=min(lower / 10.0, known.objective), nodes=rounds)


def _offenders(
    solution: tuple[Candidate, ...], bins: Sequence[BinModel], engine: Engine
) -> tuple[Candidate, ...]:
    """The first box that breaks a rule, and the boxes of its bin before it.

    Only what lies under it decides about support; loads may come from anywhere in the bin.
    """
    for last in range(1, len(solution) + 1):
        if joint_violations(solution[:last], bins, engine):
            index = solution[last - 1].bin_index
            return tuple(one for one in solution[:last] if one.bin_index == index)
    return solution
