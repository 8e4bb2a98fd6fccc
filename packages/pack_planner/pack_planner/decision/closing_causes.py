"""What keeps each box on offer out of the open bins, when one is closed for them.

Rules are left out one after another until a box finds a place: the last one left out is the cause.
Nothing here changes a decision; it is asked once for each bin that is closed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

from pack_msgs_py.closing import Cause
from pack_msgs_py.codes import ErrorCode
from pack_msgs_py.profiles import Profile
from pack_msgs_py.rules import may_enter
from pack_msgs_py.values import Bin, Box
from pack_planner.decision.policy import DecisionState
from pack_planner.decision.refusals import Forbidden
from pack_planner.engine import Engine
from pack_planner.engine.engine import nothing_forbidden


class ClosingCauses:
    """Finds the causes under one profile; keeps the engines that leave rules out."""

    def __init__(self, profile: Profile) -> None:
        anything = replace(profile, max_payload_kg=None)
        self._any_weight = Engine(replace(anything, max_bin_weight_kg=None))
        self._any_load = Engine(replace(anything, check_top_load=False))
        self._any_support = Engine(
            replace(
                anything,
                min_vertices=0,
                com_margin_mm=None,
                min_support_share=0.0,
                stability_margin_mm=None,
                check_top_load=False,
            )
        )
        self.profile = profile

    def of(self, engine: Engine, state: DecisionState) -> Mapping[Cause, int]:
        """How many of the boxes on offer each cause keeps out; ``engine`` has all the rules."""
        return Counter(self._cause(engine, box, state.bins, state.forbidden) for box in state.boxes)

    def _cause(self, engine: Engine, box: Box, bins: Sequence[Bin], forbidden: Forbidden) -> Cause:
        serving = [target for target in bins if may_enter(box, target.destination)]
        if not serving:
            return Cause.DESTINATION

        def has_place(by: Engine, refused: Forbidden | None = None) -> bool:
            models = [by.model(target) for target in serving]
            zones = nothing_forbidden if refused is None else refused
            return by.best_placement(box, models, zones) is not None

        if has_place(engine, forbidden):
            return Cause.OVERLOOKED
        if has_place(engine):
            other = forbidden.without(ErrorCode.DEADLINE_UNREACHABLE)
            return Cause.TOO_SLOW if has_place(engine, other) else Cause.REFUSED
        if has_place(self._any_weight):
            return Cause.BIN_WEIGHT
        if has_place(self._any_load):
            return Cause.TOP_LOAD
        return Cause.NO_SUPPORT if has_place(self._any_support) else Cause.TOO_HIGH
