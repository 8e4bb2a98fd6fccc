"""One decision: from what lies on the belt and in the bins to what is to be done."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from pack_msgs_py.cell_values import Decision
from pack_msgs_py.closing import Cause
from pack_msgs_py.codes import PlacementStatus, Reason
from pack_msgs_py.geometry.pose import Pose, metres
from pack_msgs_py.geometry.resting import resting_pose
from pack_msgs_py.orientation import QUATERNIONS
from pack_msgs_py.rules import may_enter
from pack_msgs_py.values import Bin, Box, PlacedBox
from pack_msgs_py.wording import how_many
from pack_planner.algorithms.base import Choice, Memory
from pack_planner.algorithms.warm_up import warm_up
from pack_planner.decision.bin_closing import next_destination
from pack_planner.decision.closing_causes import ClosingCauses
from pack_planner.decision.policy import (
    DecisionState,
    PolicySettings,
    by_wait,
    check_choice,
    next_step,
)
from pack_planner.engine import Candidate, Engine, Weights

__all__ = [
    'CloseStep',
    'DecisionState',
    'PlaceStep',
    'Planner',
    'PlannerStep',
    'PolicySettings',
    'RejectStep',
    'WaitStep',
    'expected_bins',
    'refreshed_target',
    'target_pose',
]  # fmt: skip


@dataclass(frozen=True)
class PlaceStep:
    """Put this box there; ``decision`` lacks only sequence numbers and stamps.

    ``others`` are what the algorithm would do instead, best first, as far as it says so; ``nodes``
    how many it took of the search.
    """

    decision: Decision
    others: tuple[Decision, ...] = ()
    nodes: int = 0


@dataclass(frozen=True)
class CloseStep:
    """Nothing fits: close this bin.

    ``destination`` is whom the next one serves, empty for any; ``causes`` counts the boxes on offer
    by what keeps them out.
    """

    target: Bin
    destination: str = ''
    causes: Mapping[Cause, int] = field(default_factory=dict)


@dataclass(frozen=True)
class RejectStep:
    """This box can go into no bin; ``decision`` says why."""

    decision: Decision


@dataclass(frozen=True)
class WaitStep:
    """There is nothing to decide, and why."""

    reason: str


PlannerStep = PlaceStep | CloseStep | RejectStep | WaitStep


class Planner:
    """Decides under the settings of the moment; keeps what makes the next decision cheaper."""

    def __init__(self, settings: PolicySettings, clock: Callable[[], float]) -> None:
        """``clock`` returns seconds of a steady clock."""
        self._clock = clock
        self._memory = Memory()
        self._engines: dict[Weights, Engine] = {}
        self._causes: ClosingCauses | None = None
        self.use(settings)

    def use(self, settings: PolicySettings) -> None:
        """Decide under ``settings`` from now on."""
        warm_up(settings.algorithm, settings.profile, settings.backend)
        kept = {
            weights: engine
            for weights, engine in self._engines.items()
            if engine.profile == settings.profile
        }
        self._engines = {
            weights: kept.get(weights) or Engine(settings.profile, weights)
            for weights in settings.weights.every()
        }
        self._settings = settings

    def _closing_causes(self) -> ClosingCauses:
        profile = self._settings.profile
        if self._causes is None or self._causes.profile != profile:
            self._causes = ClosingCauses(profile)
        return self._causes

    def decide(self, state: DecisionState) -> PlannerStep:
        """What to do next.

        Boxes that no empty bin takes come first, since they block a place on the belt. Then
        :func:`pack_planner.decision.policy.next_step` places one or closes a bin. Bins of several
        kinds count with the weights of the oldest.
        """
        started = self._clock()
        if not state.boxes:
            return WaitStep('the belt is empty')
        if not state.bins:
            return WaitStep('no bin is open')
        engine = self._engines[self._settings.weights.of(state.bins[0].spec)]
        for box in state.boxes:
            rejected = self._why_reject(engine, box, state)
            if rejected is not None:
                reason, text = rejected
                return RejectStep(self._reject(box, reason, text, started))
        choice = next_step(self._settings, engine, state, self._memory)
        if choice is None:
            return WaitStep('no box fits and every bin is empty')
        if isinstance(choice, Bin):
            left = [other for other in state.bins if other.id != choice.id]
            causes = self._closing_causes().of(engine, state)
            return CloseStep(choice, next_destination(choice, by_wait(state), left), causes)
        check_choice(self._settings, engine, state, choice)
        seconds = self._clock() - started
        made = [
            self._made(choice, candidate, state.bins, seconds)
            for candidate in (choice.candidate, *choice.others)
        ]
        return PlaceStep(made[0], tuple(made[1:]), choice.nodes)

    def _made(
        self, choice: Choice, candidate: Candidate, bins: Sequence[Bin], seconds: float
    ) -> Decision:
        """``candidate``, which ``choice`` names, as a decision that took ``seconds``."""
        target, placed = bins[candidate.bin_index], candidate.placed
        first = candidate is choice.candidate
        return Decision(
            box=placed.box,
            bin_id=target.id,
            bin_serial=target.serial,
            bin_revision=target.revision,
            orientation=placed.orientation,
            corner_mm=placed.corner_mm,
            size_mm=placed.size_mm,
            target=target_pose(placed, target),
            objective=candidate.objective,
            algorithm=self._settings.spec.name,
            profile=self._settings.profile.name,
            status=choice.status,
            reason=choice.reason if first else 'next best',
            planning_s=seconds if first else 0.0,
        )

    def _reject(self, box: Box, reason: Reason, text: str, started: float) -> Decision:
        return Decision(
            box=box,
            algorithm=self._settings.spec.name,
            profile=self._settings.profile.name,
            status=PlacementStatus.REJECT,
            reject_reason=reason,
            reason=text,
            planning_s=self._clock() - started,
        )

    def _why_reject(
        self, engine: Engine, box: Box, state: DecisionState
    ) -> tuple[Reason, str] | None:
        bins = state.bins
        too_heavy = engine.overweight(box)
        if too_heavy:
            return Reason.OVERWEIGHT, f'box {box.id!r} {too_heavy}'
        if not any(engine.fits_empty_bin(box, target.spec) for target in bins):
            size = 'x'.join(f'{edge:g}' for edge in box.size_mm)
            kinds = ', '.join(sorted({target.spec.name for target in bins}))
            rule = self._settings.profile.orientations
            return (
                Reason.OVERSIZE,
                f'box {box.id!r} of {size} mm fits no empty {kinds} bin, orientations {rule!r}',
            )
        if not box.destination and all(target.destination for target in bins):
            text = f'box {box.id!r} has no destination, and every open bin serves one'
            return Reason.INVALID_DATA, text
        for target in bins:
            refused = state.forbidden.refused(box, target)
            if target.boxes or not refused or _may_go_elsewhere(box, target, state):
                continue
            models = [engine.model(other) for other in bins]
            if engine.best_placement(box, models, state.forbidden) is None:
                text = (
                    f'the arm refused box {box.id!r} {how_many(len(refused), "time")} in the '
                    f'empty bin {target.id!r} and no other placement is left'
                )
                return Reason.UNREACHABLE, text
        return None


def _may_go_elsewhere(box: Box, refusing: Bin, state: DecisionState) -> bool:
    """Whether the arm may reach a place for ``box`` at a station whose bin is not empty yet.

    What is too far or too slow at one station need not be so at another. Then the box waits, or a
    bin is closed there when nothing else fits.
    """
    if state.forbidden.too_much_for_the_arm(box, refusing):
        return False
    stations = {target.station for target in state.bins if not target.boxes}
    return any(
        target.station not in stations and may_enter(box, target.destination)
        for target in state.bins
        if target.boxes
    )


def target_pose(placed: PlacedBox, target: Bin) -> Pose:
    """Pose of the box's centre at rest, bin frame, metres.

    x and y are the centre of the reserved rectangle. z is where the box will physically come to
    rest, which lies below the planned height as far as sizes were rounded up under it.
    """
    (x, y, _), (dx, dy, _) = placed.corner_mm, placed.size_mm
    centre = metres((x + dx / 2, y + dy / 2, 0.0))
    return resting_pose(placed, Pose(centre, QUATERNIONS[placed.orientation]), target.boxes)


def expected_bins(bins: tuple[Bin, ...], decision: Decision) -> tuple[Bin, ...]:
    """The bins as they will be when ``decision`` has been carried out."""
    x, y, z = (1000.0 * value for value in decision.target.position)
    placed = PlacedBox(
        decision.box, decision.corner_mm, decision.size_mm, decision.orientation, (x, y, z)
    )
    return tuple(
        replace(target, boxes=(*target.boxes, placed), revision=decision.bin_revision + 1)
        if target.id == decision.bin_id
        else target
        for target in bins
    )


def refreshed_target(decision: Decision, target: Bin) -> Decision:
    """``decision`` with its pose on the boxes of ``target`` as they were measured since."""
    placed = PlacedBox(decision.box, decision.corner_mm, decision.size_mm, decision.orientation)
    return replace(decision, target=target_pose(placed, target))
