"""The algorithms by name: built in, of an installed package, or of a file of one's own."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import EntryPoints, entry_points
from typing import TypeVar

from pack_planner.algorithms.base import Algorithm, Choice, Problem
from pack_planner.algorithms.built_in import BUILT_IN
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
    digest : of the file of one's own that it comes from, see
        :func:`pack_planner.algorithms.own_file.load`.
    """

    name: str
    decide: Algorithm
    backends: bool = False
    alternatives: str = ''
    prepare: Callable[[Engine], None] | None = None
    digest: str = ''

    @property
    def is_built_in(self) -> bool:
        """Whether it is one of :data:`BUILT_IN`."""
        return self.decide.__module__.startswith(_FOLDER + '.')

    def __call__(self, problem: Problem) -> Choice | None:
        """Decide.

        Raises
        ------
        AlgorithmError
            An algorithm of someone else raised an error, or returned something else.
        """
        try:
            choice: object = self.decide(problem)
        except Exception as error:
            if self.is_built_in:
                raise
            msg = f'algorithm {self.name!r} failed: {told(error, self.decide)}'
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


def algorithm(
    name: str,
    *,
    backends: bool = False,
    alternatives: str = '',
    prepare: Callable[[Engine], None] | None = None,
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
        SPECS[name] = AlgorithmSpec(
            name, check_function(name, function), backends, alternatives, prepare
        )
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
    which : the name of a built-in or registered algorithm or of one of an installed package;
        ``FILE.py:FUNCTION``; or the function itself.
    digest : of the file that is meant; one that was read before in another version is read again.

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
        import_module(f'{_FOLDER}.{which}')
        return SPECS[which]
    if '.py' in which:
        from pack_planner.algorithms.own_file import load

        return load(which, digest)
    return _of_package(which)


def algorithm_names() -> tuple[str, ...]:
    """Every name that :func:`find_algorithm` knows, the built-in ones first."""
    return tuple(dict.fromkeys((*BUILT_IN, *SPECS, *_installed().names)))


def _of_function(function: Algorithm) -> AlgorithmSpec:
    if isinstance(function, AlgorithmSpec):
        return function
    for spec in SPECS.values():
        if spec.decide is function:
            return spec
    name = getattr(function, '__name__', type(function).__name__)
    return AlgorithmSpec(name, check_function(name, function))


def _installed() -> EntryPoints:
    return entry_points(group=ENTRY_POINTS)


def _of_package(name: str) -> AlgorithmSpec:
    for entry in _installed().select(name=name):
        try:
            function = entry.load()
        except Exception as error:
            msg = f'algorithm {name!r} of the installed {entry.value} cannot be used: {error}'
            raise ValueError(msg) from error
        if name not in SPECS:
            SPECS[name] = AlgorithmSpec(name, check_function(name, function))
        return SPECS[name]
    msg = f'unknown algorithm {name!r}: use one of {", ".join(algorithm_names())}'
    raise ValueError(msg)


def told(error: BaseException, near: Algorithm | str) -> str:
    """``error`` in a line; with the last line of the file of ``near`` that it went through."""
    file = near if isinstance(near, str) else inspect.getsourcefile(near) or ''
    line, trace = 0, error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    text = f'{type(error).__name__}: {error}'
    return f'{text} ({file}, line {line})' if line else text
