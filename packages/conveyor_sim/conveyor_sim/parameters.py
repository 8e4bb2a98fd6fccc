"""Parameters of the node `conveyor`."""

from __future__ import annotations

from dataclasses import dataclass

from conveyor_sim.belt.jams import FORMS as JAMS
from conveyor_sim.induct.arrivals import FORMS as ARRIVALS
from conveyor_sim.streams import SYNTAX
from pack_msgs_py.orientation import TILT_TIME_S
from pack_msgs_py.parameter_fields import parameter


@dataclass(frozen=True)
class ConveyorParameters:
    """What an operator can set; see the table in the README."""

    boxes_file: str = parameter(
        '',
        f'Boxes: {SYNTAX}; empty for the built-in stream of 40 cartons.',
        read_only=True,
    )
    units: str = parameter(
        '',
        'Units of a box file that does not say them, such as `cm,kg`, `in,lb` or `g`.',
        read_only=True,
    )
    decimal: str = parameter(
        '',
        'Decimal mark of a box file, where its numbers do not tell: `point` or `comma`.',
        read_only=True,
    )
    order_by: str = parameter(
        '',
        'Column of a box file whose values become destinations, so that orders keep apart.',
        read_only=True,
    )
    count: int = parameter(
        0,
        'Boxes to supply, rejected rows included; 0 for the whole file. '
        'More than the file holds: it repeats, or more of them are made.',
        low=0,
        high=1_000_000,
        read_only=True,
    )
    seed: int = parameter(
        0,
        'Order of the boxes: 0 as listed, else shuffled, the same for equal seeds; also of what '
        'is made or drawn, of faults and of the errors of the scanner.',
        low=0,
        high=2**31 - 1,
        read_only=True,
    )
    destinations: int = parameter(
        0,
        'Give each box that has none a destination `D1` to `D<n>`, at random; 0 for none.',
        low=0,
        high=1000,
        read_only=True,
    )
    size_sigma: float = parameter(
        0.0,
        'Standard deviation of each edge that the scanner measures; 0 for the true size.',
        unit='mm',
        low=0.0,
        high=50.0,
        read_only=True,
    )
    yaw_sigma: float = parameter(
        0.0,
        'Standard deviation of the angle at which a box lies on the belt, unknown to the scanner.',
        unit='degrees',
        low=0.0,
        high=10.0,
        read_only=True,
    )
    pose_noise: float = parameter(
        0.0,
        'How far, at most, a box lies beside the middle of the belt, and behind the guide; the '
        'scanner sees it.',
        unit='mm',
        low=0.0,
        high=100.0,
        read_only=True,
    )
    yaw_noise: float = parameter(
        0.0,
        'How far, at most, a box lies turned on the belt, either way; the scanner sees it.',
        unit='degrees',
        low=0.0,
        high=45.0,
        read_only=True,
    )
    weight_sigma: float = parameter(
        0.0,
        'Standard deviation of the weight that the scanner measures.',
        unit='kg',
        low=0.0,
        high=5.0,
        read_only=True,
    )
    faults: str = parameter(
        '',
        'What goes wrong how often, such as `no_read=0.01,touching=0.005` or `all=0.01`; '
        'docs/faults.md lists them.',
        read_only=True,
    )
    look_ahead: int = parameter(
        5, 'Boxes on the belt, all of which the planner sees.', low=1, high=6, read_only=True
    )
    belt_mode: str = parameter(
        'stop_at_pick',
        '`stop_at_pick` turns the chosen box to the pick point, the shorter way, and holds it; '
        '`continuous` runs all the time, and a stop blade holds it for `pick_window`.',
        choices=('stop_at_pick', 'continuous'),
        read_only=True,
    )
    belt_length: float = parameter(
        9.0, 'Length of the loop.', unit='m', low=6.0, high=100.0, read_only=True
    )
    belt_speed: float = parameter(
        1.5, 'Speed of the belt in robot time.', unit='m/s', low=0.05, high=10.0
    )
    gap: float = parameter(
        0.3,
        'Least free way between two boxes; the longest that can ride is `belt_length` / '
        '`look_ahead` less this.',
        unit='m',
        low=0.05,
        high=2.0,
        read_only=True,
    )
    pick_window: float = parameter(
        12.0,
        'Robot time for which the blade of a continuous belt holds a box; the arm goes for it in '
        'the first half, which should be longer than the arm needs for a box.',
        unit='s',
        low=0.5,
        high=600.0,
        read_only=True,
    )
    tilt_tray: bool = parameter(
        True,
        'Whether a tray at the pick point of `stop_at_pick` tips the chosen box, so that the face '
        'comes up that its placement names; `continuous` has none.',
        read_only=True,
    )
    tilt_time: float = parameter(
        TILT_TIME_S,
        'Robot time in which the tray tips a box, or tips it back; empty it takes half of that.',
        unit='s',
        low=0.1,
        high=60.0,
        read_only=True,
    )
    arrivals: str = parameter(
        'saturated',
        f'When boxes come to the induct, in robot time: {ARRIVALS}.',
        read_only=True,
    )
    jams: str = parameter('', f'When the belt jams, in robot time: {JAMS}.', read_only=True)
    max_laps: int = parameter(
        100,
        'A box that was passed over more often goes to the reject lane; 0 for any number.',
        low=0,
        high=1_000_000,
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
    acknowledge: str = parameter(
        'operator',
        'Who acknowledges a jam before the belt goes on: an `operator`, or the cell `itself`, '
        'where nobody stands by, as in a simulation.',
        choices=('operator', 'itself'),
        read_only=True,
    )
    state_dir: str = parameter(
        '',
        'Folder of the ledger `conveyor.sqlite`; empty keeps it in memory.',
        read_only=True,
    )
