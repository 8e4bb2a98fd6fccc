"""The algorithms by name: built in, of an installed package, or of a file of one's own."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import TypeVar

from pack_msgs_py.plug_ins import (
    PlugInError,
    absolute_place,
    content_digest,
    load_plug_in,
    plug_ins_by_name,
    said,
)
from pack_msgs_py.profiles import Profile
from pack_planner.algorithms.base import Algorithm, Choice, Problem
from pack_planner.algorithms.built_in import BUILT_IN
from pack_planner.algorithms.tuned_tables import weights_for
from pack_planner.engine import Engine

#: Where an installed package names its algorithms: ``my_rule = my_package.my_module:my_rule``.
ENTRY_POINTS = 'pack_planner.algorithms'

_FOLDER = 'pack_planner.algorithms'

A = TypeVar('A', bound=Algorithm)


class AlgorithmError(RuntimeError):
    """An algorithm that is not built in failed, or answered what is no answer."""


@dataclass(frozen=True, eq=False)
class AlgorithmSpec:
    """An algorithm and what the others need to know of it; call it with a problem.

    Attributes
    ----------
    name : as users write it, and as records and messages have it.
    decide : the algorithm itself.
    backends : it minimises eq. (1), and so can leave that to another backend, and obey the
        constraints for efficient packing; see :class:`Problem`.
    alternatives : name of the algorithm that says what to do when the arm refuses the choice;
        empty for itself. One that takes long needs a quick one.
    prepare : compiles, or loads, what deciding on a few boxes in one bin does not reach.
    weights : a dataclass of numbers that ``cell tune`` may change, as they are where none are
        tuned; ``None`` for an algorithm without. It finds those to use in ``problem.weights``.
    weights_by : what takes the place of ``weights`` under a profile and with a number of open bins,
        where these do not hold for all of them.
    node_s : about what a node of its search costs, seconds; ``None`` for one that counts none.
    digest : changes with the content of the file that it comes from, if it was asked for by that.
    """

    name: str
    decide: Algorithm
    backends: bool = False
    alternatives: str = ''
    prepare: Callable[[Engine], None] | None = None
    weights: object = None
    weights_by: Callable[[Profile, int], object] | None = None
    node_s: float | None = None
    digest: str = ''

    @property
    def is_built_in(self) -> bool:
        """Whether it is one of :data:`BUILT_IN`."""
        return self.decide.__module__.startswith(_FOLDER + '.')

    @property
    def counted_node_s(self) -> float | None:
        """What a node counts; ``None`` where only a clock knows how long it decides.

        Built-in algorithms that count none decide in a few milliseconds.
        """
        return 0.0 if self.node_s is None and self.is_built_in else self.node_s

    def own_weights(self, profile: Profile, open_bins: int) -> object:
        """Its weights where none are tuned."""
        return self.weights if self.weights_by is None else self.weights_by(profile, open_bins)

    def __call__(self, problem: Problem) -> Choice | None:
        """Decide.

        Raises
        ------
        AlgorithmError
            An algorithm of someone else raised an error, or returned something else.
        """
        if self.weights is not None and not isinstance(problem.weights, type(self.weights)):
            spec, profile = problem.bins[0].source.spec, problem.engine.profile
            own = self.own_weights(profile, len(problem.bins))
            weights = weights_for(problem.tuned, self.name, own, spec, profile)
            problem = replace(problem, weights=weights)
        try:
            choice: object = self.decide(problem)
        except Exception as error:
            if self.is_built_in:
                raise
            file = inspect.getsourcefile(self.decide) or ''
            msg = f'algorithm {self.name!r} failed: {said(error, file)} in {file}'
            raise AlgorithmError(msg) from error
        if choice is None or isinstance(choice, Choice):
            return choice
        msg = (
            f'algorithm {self.name!r} returned {type(choice).__name__}; '
            'it must return a Choice, or None when nothing fits'
        )
        raise AlgorithmError(msg)


#: What is registered so far, by name.
SPECS: dict[str, AlgorithmSpec] = {}
_plug_ins: dict[str, AlgorithmSpec] = {}
#: Where a registered function keeps its specification.
_ATTRIBUTE = '_algorithm_spec'


def algorithm(
    name: str,
    *,
    backends: bool = False,
    alternatives: str = '',
    prepare: Callable[[Engine], None] | None = None,
    weights: object = None,
    weights_by: Callable[[Profile, int], object] | None = None,
    node_s: float | None = None,
) -> Callable[[A], A]:
    """Register the decorated function, which stays as it is, as the algorithm called ``name``.

    The other arguments are described at :class:`AlgorithmSpec`. Registering a name again replaces
    what had it.

    Raises
    ------
    ValueError
        The name is that of a built-in algorithm, or no name; the function takes something else
        than one problem.
    """

    def register(function: A) -> A:
        if not name.isidentifier():
            msg = f'algorithm name {name!r} is no name such as my_rule'
            raise ValueError(msg)
        if name in BUILT_IN and function.__module__ != f'{_FOLDER}.{name}':
            msg = f'algorithm name {name!r} is taken by a built-in one: choose another'
            raise ValueError(msg)
        decide = check_function(name, function)
        SPECS[name] = AlgorithmSpec(
            name, decide, backends, alternatives, prepare, weights, weights_by, node_s
        )
        setattr(function, _ATTRIBUTE, SPECS[name])
        return function

    return register


def check_function(name: str, function: object) -> Algorithm:
    """``function`` if it can be called with one problem; else ``ValueError``."""
    if not callable(function):
        msg = f'{name} is no function but {type(function).__name__}'
        raise ValueError(msg)
    signature = inspect.signature(function)
    try:
        signature.bind(None)
    except TypeError:
        msg = (
            f'{name}{signature} is no algorithm: it must take one Problem and return a Choice, '
            'or None when nothing fits'
        )
        raise ValueError(msg) from None
    return function


def find_algorithm(which: str | Algorithm, digest: str = '') -> AlgorithmSpec:
    """The algorithm that is meant.

    Parameters
    ----------
    which : the function itself; the name of a built-in or registered algorithm, or of one of an
        installed package; ``folder/FILE.py:FUNCTION`` or ``MODULE:FUNCTION``.
    digest : of the content that the file is to have; without one, a file is read once.

    Raises
    ------
    ValueError
        There is no such algorithm, or its file or package cannot be used; the text says why.
    """
    if not isinstance(which, str):
        return _of_function(which)
    if which in SPECS:
        return SPECS[which]
    if which in BUILT_IN:
        return _of_function(getattr(import_module(f'{_FOLDER}.{which}'), which))
    which = absolute_place(which)
    if which not in _plug_ins or digest not in ('', _plug_ins[which].digest):
        _plug_ins[which] = _of_plug_in(which)
    spec = _plug_ins[which]
    if digest not in ('', spec.digest):
        msg = f'algorithm {which!r} has changed since it was asked for: start again'
        raise ValueError(msg)
    return spec


def algorithm_names() -> tuple[str, ...]:
    """Every name that :func:`find_algorithm` knows, the built-in ones first."""
    return tuple(dict.fromkeys((*BUILT_IN, *SPECS, *plug_ins_by_name(ENTRY_POINTS))))


def _of_function(function: Algorithm) -> AlgorithmSpec:
    if isinstance(function, AlgorithmSpec):
        return function
    registered = getattr(function, _ATTRIBUTE, None)
    if isinstance(registered, AlgorithmSpec):
        return registered
    name = getattr(function, '__name__', type(function).__name__)
    return AlgorithmSpec(name, check_function(name, function))


def _of_plug_in(which: str) -> AlgorithmSpec:
    where = plug_ins_by_name(ENTRY_POINTS).get(which, which)
    if ':' not in where:
        hint = f'{which}:FUNCTION' if where.endswith('.py') else 'FILE.py:FUNCTION for your own'
        msg = f'unknown algorithm {which!r}: use one of {", ".join(algorithm_names())}, or {hint}'
        raise ValueError(msg)
    try:
        digest, function = content_digest(where), load_plug_in(where)
    except PlugInError as error:
        msg = f'algorithm {error}'
        raise ValueError(msg) from error
    # folders make a table unreadable
    shown = Path(which).name if digest else which
    spec = _of_function(check_function(shown, function))
    return replace(spec, name=shown, digest=digest)
