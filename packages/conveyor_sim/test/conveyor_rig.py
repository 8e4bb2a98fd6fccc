"""A conveyor with a clock, for the tests of its core."""

from __future__ import annotations

from dataclasses import replace

from conveyor_sim.factory import make_conveyor, make_ledger
from conveyor_sim.parameters import ConveyorParameters
from conveyor_sim.streams import RejectedRow, Stream
from pack_msgs_py.cell_values import BoxEvent, Decision
from pack_msgs_py.codes import PlacementStatus, Reason
from pack_msgs_py.values import Box

EPOCH = 1_700_000_000.0
SIZE = (300.0, 200.0, 100.0)


def bad_row(name):
    return RejectedRow(name, 'f.csv', 3, 'width_mm', 'x', Reason.INVALID_DATA, 'f.csv, line 3: x')


class ConveyorRig:
    """A conveyor with a clock and shorthands for what others tell it."""

    def __init__(self, entries=None, *, folder='', count=0, slots=5, **parameters):
        entries = entries or tuple(Box(f'b{n}', SIZE) for n in range(10))
        self.now = 100.0
        self.stream = Stream(tuple(entries), count)
        self.parameters = ConveyorParameters(look_ahead=slots, **parameters)
        self.ledger = make_ledger(replace(self.parameters, state_dir=str(folder)), self.stream)
        self.conveyor = make_conveyor(self.parameters, self.stream, self.ledger)
        self.sequence = 0
        self.started = self.conveyor.start(*self.clock())

    def clock(self):
        return self.now, EPOCH + self.now

    def scan(self):
        return self.conveyor.scan(*self.clock())

    def ids(self):
        return [item.box.id for item in self.scan().boxes]

    def decide(
        self,
        box_id,
        *,
        reject=False,
        reason=Reason.OVERSIZE,
        sequence=None,
        stamp=None,
        orientation='xyz',
    ):
        self.sequence += 1
        status = PlacementStatus.REJECT if reject else PlacementStatus.OPTIMAL
        decision = Decision(
            Box(box_id, SIZE),
            bin_id='' if reject else 'LDC-1',
            status=status,
            orientation=orientation,
            sequence=self.sequence if sequence is None else sequence,
            stamp_s=EPOCH + self.now if stamp is None else stamp,
            reason='fits no bin' if reject else '',
            reject_reason=reason if reject else Reason.NONE,
        )
        return self.conveyor.on_decision(decision, *self.clock())

    def event(self, box_id, kind, stamp=None):
        stamp_s = EPOCH + (self.now if stamp is None else stamp)
        return self.conveyor.on_event(BoxEvent(box_id, kind, stamp_s=stamp_s), *self.clock())

    def wait(self, seconds=5.0):
        self.now += seconds

    def step(self, seconds, period=0.1):
        """Time passes with a tick every tenth of a second, as in the node."""
        news = []
        end = self.now + seconds
        while self.now < end:
            self.now = min(end, self.now + period)
            news.append(self.conveyor.tick(*self.clock()))
        return news

    def restart(self):
        """Another conveyor on the same ledger, as after a kill: nothing is written at the end."""
        self.conveyor = make_conveyor(self.parameters, self.stream, self.ledger)
        return self.conveyor.start(*self.clock())
