"""Linear constraints under conditions: one formulation for CP-SAT and for a MILP.

CP-SAT takes the conditions as they are, a MILP through constants large enough to switch a
constraint off, as Ojha et al. write theirs.
"""

from __future__ import annotations

from dataclasses import dataclass, field

#: A term: coefficient and number of a variable.
Term = tuple[int, int]


@dataclass(frozen=True)
class Constraint:
    """``sum(terms) <= limit`` whenever all 0/1 variables ``when`` are 1."""

    terms: tuple[Term, ...]
    limit: int
    when: tuple[int, ...] = ()


@dataclass
class Formulation:
    """Integer variables, constraints and a linear objective to minimise.

    Attributes
    ----------
    lows, highs : bounds of each variable.
    constraints : see :class:`Constraint`.
    costs : coefficient of each variable that has one in the objective.
    offset : constant part of the objective.
    hints : a known solution, as far as it is known.
    """

    lows: list[int] = field(default_factory=list)
    highs: list[int] = field(default_factory=list)
    constraints: list[Constraint] = field(default_factory=list)
    costs: dict[int, float] = field(default_factory=dict)
    offset: float = 0.0
    hints: dict[int, int] = field(default_factory=dict)

    def integer(self, low: int, high: int) -> int:
        """A new variable from ``low`` to ``high``; returns its number."""
        self.lows.append(low)
        self.highs.append(high)
        return len(self.lows) - 1

    def boolean(self) -> int:
        """A new 0/1 variable."""
        return self.integer(0, 1)

    def at_most(self, terms: list[Term], limit: int, *when: int) -> None:
        """Ask for ``sum(terms) <= limit`` when all of ``when`` hold."""
        self.constraints.append(Constraint(tuple(terms), limit, when))

    def at_least(self, terms: list[Term], limit: int, *when: int) -> None:
        """Ask for ``sum(terms) >= limit`` when all of ``when`` hold."""
        self.at_most([(-factor, number) for factor, number in terms], -limit, *when)

    def equal(self, terms: list[Term], value: int, *when: int) -> None:
        """Ask for ``sum(terms) == value`` when all of ``when`` hold."""
        self.at_most(terms, value, *when)
        self.at_least(terms, value, *when)

    def one_of(self, choices: list[int], *when: int) -> None:
        """At least one of the 0/1 variables when all of ``when`` hold."""
        self.at_least([(1, choice) for choice in choices], 1, *when)

    def range_of(self, terms: tuple[Term, ...]) -> tuple[int, int]:
        """Least and greatest value that the variables' bounds allow ``terms``."""
        ends = [(f * self.lows[n], f * self.highs[n]) for f, n in terms]
        return sum(min(pair) for pair in ends), sum(max(pair) for pair in ends)
