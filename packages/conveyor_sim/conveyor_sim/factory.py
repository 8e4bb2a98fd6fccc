"""The conveyor that the parameters ask for."""

from __future__ import annotations

from conveyor_sim.belt.indexing_belt import IndexingBelt
from conveyor_sim.belt.jams import find_jams
from conveyor_sim.belt.loop import Belt
from conveyor_sim.belt.running_belt import RunningBelt
from conveyor_sim.conveyor.conveyor import Conveyor
from conveyor_sim.conveyor.operating_conditions import OperatingConditions
from conveyor_sim.induct.arrivals import find_arrivals
from conveyor_sim.ledger.ledger import Ledger
from conveyor_sim.parameters import ConveyorParameters
from conveyor_sim.scanning.fault_plan import FaultPlan, parse_faults
from conveyor_sim.scanning.inspection import Inspection
from conveyor_sim.scanning.lie import BoxLies
from conveyor_sim.scanning.scanner import Scanner, ScannerNoise
from conveyor_sim.streams import Reading, Stream


def make_belt(p: ConveyorParameters) -> Belt:
    """The belt of `belt_mode`; ``ValueError`` when the look-ahead does not fit on it."""
    if p.belt_mode == 'continuous':
        return RunningBelt(
            p.belt_length,
            p.look_ahead,
            p.belt_speed,
            p.speed,
            gap_m=p.gap,
            window_s=p.pick_window,
        )
    return IndexingBelt(
        p.belt_length,
        p.look_ahead,
        p.belt_speed,
        p.speed,
        gap_m=p.gap,
        tilt_time_s=p.tilt_time if p.tilt_tray else None,
    )


def make_inspection(p: ConveyorParameters) -> Inspection:
    """Scanner and faults; ``ValueError`` when a fault or a rate is not known."""
    noise = ScannerNoise(p.size_sigma, p.weight_sigma, p.yaw_sigma)
    return Inspection(
        Scanner(noise, p.seed),
        FaultPlan(parse_faults(p.faults), p.seed),
        BoxLies(p.pose_noise, p.yaw_noise, p.seed),
    )


def open_stream(p: ConveyorParameters) -> Stream:
    """The stream of `boxes_file`; ``ValueError`` when it cannot be used."""
    reading = Reading(p.units, p.decimal, p.order_by)
    return Stream.open(p.boxes_file, p.count, p.seed, p.destinations, reading)


def make_ledger(p: ConveyorParameters, stream: Stream) -> Ledger:
    """The ledger of this stream, and of what the inspection makes of it."""
    return Ledger(p.state_dir, stream.fingerprint + make_inspection(p).key, stream.description)


def make_conveyor(p: ConveyorParameters, stream: Stream, ledger: Ledger) -> Conveyor:
    """A conveyor that has not been started; ``ValueError`` when a parameter cannot be used."""
    conditions = OperatingConditions(
        arrivals=find_arrivals(p.arrivals, p.seed),
        jams=find_jams(p.jams, p.seed),
        max_laps=p.max_laps,
        inspection=make_inspection(p),
        speed=p.speed,
    )
    return Conveyor(stream, make_belt(p), ledger, length_m=p.belt_length, conditions=conditions)
