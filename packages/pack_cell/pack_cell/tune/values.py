"""What a tuning is about."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from conveyor_sim.streams import Reading
from pack_msgs_py.profiles import Profile
from pack_msgs_py.values import BinSpec

#: Streams of which the search sees what they fill, and those on which its result is checked.
TRAINING, CHECK = 'training', 'check'


@dataclass(frozen=True)
class TuneSettings:
    """What fixes the outcome of a tuning, but for how long it goes on.

    Attributes
    ----------
    algorithm : a name, or ``/where/it/is/FILE.py:FUNCTION``.
    bin_spec : kind of the bins.
    profile : the packing rules.
    boxes : streams by name, which take turns.
    reading : how those that are files are read.
    look_ahead : boxes that the algorithm may choose from.
    open_bins : bins that stand open at a time.
    scan_sigma_mm : standard deviation of each edge that the scanner measures.
    stream_bins : a stream has boxes whose volume fills so many bins.
    streams : how many an evaluation packs.
    check_streams : on how many others the result is checked.
    seed : of streams and search.
    only : names of the weights to search; empty for all that are numbers with a fraction.
    step : first standard deviation of the search, as a share of the range of each weight.
    """

    algorithm: str
    bin_spec: BinSpec
    profile: Profile
    boxes: tuple[str, ...]
    look_ahead: int = 5
    open_bins: int = 2
    scan_sigma_mm: float = 2.0
    stream_bins: float = 6.0
    streams: int = 2
    check_streams: int = 12
    seed: int = 1
    only: tuple[str, ...] = ()
    step: float = 0.08
    reading: Reading = field(default_factory=Reading)

    @property
    def identity(self) -> dict[str, Any]:
        """All of it but the number of check streams, as JSON."""
        bin_spec = {'name': self.bin_spec.name, 'size_mm': list(self.bin_spec.size_mm)}
        lists = {'boxes': list(self.boxes), 'only': list(self.only)}
        values = {**asdict(self), **lists, 'bin_spec': bin_spec}
        del values['check_streams']
        if self.reading == Reading():
            # So that what was tried without it is known again.
            del values['reading']
        return values


#: Weights by name, in the order of the dataclass; hashable.
Weighting = tuple[tuple[str, float | bool], ...]


@dataclass(frozen=True)
class Trial:
    """One stream packed with one set of weights."""

    weights: Weighting
    part: str
    number: int
