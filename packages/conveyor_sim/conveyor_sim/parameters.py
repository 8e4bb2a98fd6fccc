"""Parameters of the node `conveyor`."""

from __future__ import annotations

from dataclasses import dataclass

from pack_msgs_py.parameters import parameter


@dataclass(frozen=True)
class ConveyorParameters:
    """What an operator can set; see the table in the README."""

    boxes_file: str = parameter(
        '',
        'Box file, CSV or BED-BPP JSON; empty for the built-in stream of 40 cartons.',
        read_only=True,
    )
    count: int = parameter(
        0,
        'Boxes to supply, rejected rows included; 0 for the whole file. '
        'More than the file holds: it repeats.',
        low=0,
        high=1_000_000,
        read_only=True,
    )
    seed: int = parameter(
        0,
        'Order of the boxes: 0 as listed, else shuffled, the same for equal seeds.',
        low=0,
        high=2**31 - 1,
        read_only=True,
    )
    look_ahead: int = parameter(
        5, 'Boxes on the belt, all of which the planner sees.', low=1, high=6, read_only=True
    )
    belt_length: float = parameter(
        9.0, 'Length of the loop.', unit='m', low=6.0, high=100.0, read_only=True
    )
    belt_speed: float = parameter(
        1.5, 'Speed of the belt in robot time.', unit='m/s', low=0.05, high=10.0
    )
    speed: float = parameter(
        1.0,
        'Robot seconds per second: 1 is real time; 0 brings boxes at once.',
        low=0.0,
        high=1000.0,
    )
    rate: float = parameter(
        10.0, 'How often `box_scan` is sent while the belt moves.', unit='Hz', low=1.0, high=100.0
    )
    state_dir: str = parameter(
        '',
        'Folder of the ledger `conveyor.sqlite`; empty keeps it in memory.',
        read_only=True,
    )
