"""Weights that were tuned for an algorithm, a kind of bin and rules, and which come nearest."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, TypeVar

from pack_msgs_py.profiles import PROFILES, Profile
from pack_msgs_py.values import BinSpec, Int3

#: A dataclass of weights of some algorithm.
W = TypeVar('W')

#: How far from what was asked for: the same; not the same, but alike; of another kind.
_SAME, _ALIKE, OTHER = 0, 1, 2


@dataclass(frozen=True)
class TunedEntry:
    """Weights of one algorithm, and what they were tuned for.

    Attributes
    ----------
    algorithm : its name.
    bin_name, bin_size_mm : kind of bin.
    profile : name of the packing rules.
    orientations : orientation rule.
    weights : pairs of name and value.
    made : how they were found and what they fill, as JSON; for people.
    """

    algorithm: str
    bin_name: str
    bin_size_mm: Int3
    profile: str
    orientations: str
    weights: tuple[tuple[str, float | bool], ...]
    made: Mapping[str, Any] = field(default_factory=dict, compare=False, repr=False)

    @property
    def key(self) -> tuple[str, str, str, str]:
        """What a table has one entry of."""
        return (self.algorithm, self.bin_name, self.profile, self.orientations)

    def over(self, default: W) -> W:
        """``default`` with these weights; those that the entry does not name stay.

        Raises
        ------
        ValueError
            A weight is unknown, or not of the type that it has there.
        """
        known = {declared.name: getattr(default, declared.name) for declared in fields(default)}  # type: ignore[arg-type]
        for name, value in self.weights:
            if name not in known:
                msg = f'unknown weight {name!r} of {self.algorithm}: use one of {", ".join(known)}'
                raise ValueError(msg)
            if isinstance(value, bool) is not isinstance(known[name], bool):
                kind = 'true or false' if isinstance(known[name], bool) else 'a number'
                msg = f'weight {name} of {self.algorithm} is {value}; it must be {kind}'
                raise ValueError(msg)
        typed = {name: type(known[name])(value) for name, value in self.weights}
        return replace(default, **typed)  # type: ignore[type-var]


@dataclass(frozen=True)
class TunedTable:
    """Entries of a file, from ``source``; at most one for the same algorithm, bin and rules."""

    entries: tuple[TunedEntry, ...] = ()
    source: str = ''

    def has(self, algorithm: str) -> bool:
        """Whether there is an entry of ``algorithm``."""
        return any(entry.algorithm == algorithm for entry in self.entries)

    @property
    def digest(self) -> str:
        """Changes with the weights and what they are for."""
        return hashlib.sha256(repr(self.entries).encode()).hexdigest()[:12]

    def nearest(self, algorithm: str, spec: BinSpec, profile: Profile) -> TunedEntry | None:
        """The entry of ``algorithm`` that was tuned for what comes nearest; ``None`` without one.

        The profile counts first (its own name, then one with the same kind of support: by vertices
        or by mechanics), then the orientation rule (its own, then one that also turns boxes over,
        or also does not), then the bin: least sum of the ratios of the edges, as logarithms, the
        longer edge of the floor with the longer.
        """
        mine = [entry for entry in self.entries if entry.algorithm == algorithm]
        return min(mine, key=lambda entry: distance(entry, spec, profile), default=None)

    def plus(self, entry: TunedEntry) -> TunedTable:
        """The table with ``entry``, in place of what it had for the same."""
        kept = [other for other in self.entries if other.key != entry.key]
        return replace(self, entries=(*kept, entry))


def unlike(entry: TunedEntry, spec: BinSpec, profile: Profile) -> str:
    """What ``entry`` was tuned for, where that is something else; else empty."""
    asked = (spec.name, profile.name, profile.orientations)
    made_for = (entry.bin_name, entry.profile, entry.orientations)
    if asked == made_for:
        return ''
    return f'tuned for {", ".join(made_for)}; used for {", ".join(asked)}'


def distance(entry: TunedEntry, spec: BinSpec, profile: Profile) -> tuple[int, int, float]:
    """How far ``entry`` is from what is asked for: by profile, by orientation rule, by bin."""
    return (
        _profile_distance(entry.profile, profile),
        _turning_distance(entry.orientations, profile.orientations),
        sum(
            abs(math.log(there / here))
            for there, here in zip(_shape(entry.bin_size_mm), _shape(spec.size_mm), strict=True)
        ),
    )


def _profile_distance(name: str, profile: Profile) -> int:
    if name == profile.name:
        return _SAME
    by_vertices = PROFILES[name].min_vertices > 0
    return _ALIKE if by_vertices is (profile.min_vertices > 0) else OTHER


def _turning_distance(one: str, other: str) -> int:
    if one == other:
        return _SAME
    return OTHER if 'upright' in (one, other) else _ALIKE


def _shape(size_mm: Int3) -> Int3:
    length, breadth, height = size_mm
    return (max(length, breadth), min(length, breadth), height)
