"""What a layout can do with a kind of bin: what the arm reaches, or why it cannot be packed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from arm_executor.model.arm_interface import MotionError
from arm_executor.model.layout import Layout, LayoutError, check_layout
from arm_executor.reach.reach import check_reach
from pack_msgs_py.values import STATIONS, BinSpec

if TYPE_CHECKING:
    from arm_executor.reach.reach_motion import StationReach


@dataclass(frozen=True)
class Verdict:
    """What came out for one kind of bin; ``refusal`` is empty when it can be packed."""

    spec: BinSpec
    stations: tuple[StationReach, ...] = ()
    refusal: str = ''


def judge(layout: Layout, spec: BinSpec, samples: int, least: float) -> Verdict:
    """What ``layout`` can do with bins of kind ``spec`` at all stations.

    ``samples`` placements of each bin are planned as whole motions; ``least`` is the share of each
    bin, 0 to 1, that must be in reach without collision.
    """
    from arm_executor.reach.reach_motion import ReachCheck

    bins = dict.fromkeys(STATIONS, spec)
    try:
        check_layout(layout, bins)
        check_reach(layout, bins, least)
    except LayoutError as error:
        return Verdict(spec, refusal=str(error))
    check = ReachCheck(layout, bins)
    try:
        stations = tuple(check.station(station, samples) for station in STATIONS)
    except MotionError as error:
        return Verdict(spec, refusal=f'layout: {error}')
    finally:
        check.close()
    refusals = [
        f'layout: {reach.share:.0%} of bin {reach.station} ({spec.name}) are in reach without '
        f'collision, at least {least:.0%} are needed'
        for reach in stations
        if reach.share < least
    ]
    return Verdict(spec, stations, '; '.join(refusals))
