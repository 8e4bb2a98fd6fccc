"""Each stream of the cell has one source: who is believed, and when a second one speaks.

A part of the cell (the belt, the arm, the planner) speaks on several topics, in one session: the
time at which its node started. A newer session is a node that was started again, unless the one
before still speaks; then there are two, and the first is believed. What is older than the one that
is believed, or was said before, is played again by somebody.

This is no protection from an attacker, who can say what he likes in anybody's name; SROS2 is.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

#: A node does not send more messages on a topic, and nobody misses more of them in a row.
MOST_SAID, MOST_MISSED = 10**10, 10_000
#: Set in the environment of nodes whose peers all say when they started, as those of `cell run` do:
#: the session of the run, which is older than theirs.
NAMED_SOURCES = 'PACK_CELL_NAMED_SOURCES'
#: No session is older: nanoseconds since the epoch of the first day of 2020.
EARLIEST = 1_577_836_800_000_000_000
#: A session may have begun so much later than now by the clock of who listens, seconds.
CLOCKS_DIFFER_S = 60.0
#: A second source is spoken of until it has been silent for so long, seconds.
SECOND_SILENT_S = 5.0
#: A last word of a node that has died may come so long after the first of the next one, seconds.
UNDER_WAY_S = 0.3
#: Messages of a node that may have been started again, which are kept until that is known.
_MOST_KEPT = 300


def new_session() -> int:
    """The session of a node that starts now."""
    return time.time_ns()


@dataclass
class _Newcomer:
    """A session that may be the next one, and what it has said so far."""

    session: int
    since_s: float
    kept: list[Callable[[], None]] = field(default_factory=list)


class OneSource:
    """Believes one session of ``part``, for example ``'the arm'``.

    Parameters
    ----------
    part : whose streams these are, for people.
    silent_s : a node that speaks regularly is dead when it has been silent for so long, seconds;
        0 for one that does not: then the newest session is believed at once. Infinite with ``own``.
    own : the session of who listens, when these are its own streams.
    since : no session that began before this one is believed; 0 where a node need not even say
        when it started. A retained message of a stranger may be the first that a node hears, and
        there is nothing yet that it could be compared with.
    """

    def __init__(
        self,
        part: str,
        silent_s: float = 0.0,
        own: int | None = None,
        *,
        since: int = 0,
    ) -> None:
        self._since = since
        self._part = part
        self._silent_s = silent_s if own is None else math.inf
        self._session = own
        self._heard_s = 0.0
        self._numbers: dict[str, int] = {}
        self._before: dict[int, dict[str, int]] = {}
        self._newcomer: _Newcomer | None = None
        self._second: tuple[str, float] | None = None

    def believes(self, session: int) -> bool:
        """Whether this is the session that is believed."""
        return session == self._session

    def second(self, now_s: float) -> str:
        """That a second source speaks, for people; empty while there is none."""
        if self._second is None or now_s - self._second[1] > SECOND_SILENT_S:
            return ''
        return self._second[0]

    def hear(
        self,
        topic: str,
        source: tuple[int, int],
        take: Callable[[], None],
        *,
        now_s: float,
        epoch_s: float,
    ) -> str:
        """A message has come: take it, keep it until more is known, or leave it.

        Parameters
        ----------
        topic : on which it came.
        source : session and number of it.
        take : called when it is believed, at once or later.
        now_s, epoch_s : now, by a steady clock and since the epoch, seconds.

        Returns
        -------
        str
            Why the message is left, for people; empty when it is not.
        """
        session, number = source
        if session < (max(EARLIEST, self._since) if session or self._since else 0):
            return self._another(topic, self._age(session), now_s)
        if session > 1e9 * (epoch_s + CLOCKS_DIFFER_S):
            ahead_s = 1e-9 * session - epoch_s
            return self._another(topic, f'says that it starts in {ahead_s:.0f} s', now_s)
        if self._session is not None and session < self._session:
            if not self._comes_back(topic, session, number, now_s):
                return self._another(topic, self._age(session), now_s)
            self._bind(session, now_s)
            self._second = None
        if self._session is None:
            self._bind(session, now_s)
        elif session > self._session:
            if self._heard_s + self._silent_s > now_s and self._silent_s:
                return self._wait_for(topic, session, take, now_s)
            self._bind(session, now_s)
        elif self._newcomer is not None and now_s - self._newcomer.since_s > UNDER_WAY_S:
            self._another(topic, self._age(self._newcomer.session), now_s)
            self._newcomer = None
        last = self._numbers.get(topic)
        if number > (MOST_SAID if last is None else last + MOST_MISSED):
            # Believed, it would make all that the source says after it look as if played again.
            return self._another(topic, f'sends message {number} after {last or 0}', now_s)
        self._heard_s = now_s
        if session and number <= (last or 0):
            return f'message {number} of {self._part} on {topic} was heard before; left out'
        self._numbers[topic] = number
        take()
        return ''

    def heard_again(self, topic: str) -> None:
        """``topic`` was subscribed to anew: what was heard last comes once more."""
        self._numbers.pop(topic, None)

    def settle(self, now_s: float) -> None:
        """Believe a node that was started again once the one before is dead, though it be silent.

        Its first words may be its last for long: what happened to a box while it was down.
        """
        newcomer = self._newcomer
        if newcomer is not None and now_s >= self._heard_s + self._silent_s:
            self._bind(newcomer.session, now_s)

    def _bind(self, session: int, now_s: float) -> None:
        newcomer, self._newcomer = self._newcomer, None
        if self._session is not None:
            self._before[self._session] = self._numbers
        self._session, self._numbers = session, self._before.pop(session, {})
        self._heard_s = now_s
        if newcomer is not None and newcomer.session == session:
            for take in newcomer.kept:
                take()

    def _comes_back(self, topic: str, session: int, number: int, now_s: float) -> bool:
        """Whether this is the first of two, which the second made unheard, and which is gone now.

        It says what it has not said before, which nobody can have recorded.
        """
        numbers = self._before.get(session)
        gone = now_s - self._heard_s > max(self._silent_s, SECOND_SILENT_S)
        return numbers is not None and gone and bool(session) and number > numbers.get(topic, 0)

    def _wait_for(self, topic: str, session: int, take: Callable[[], None], now_s: float) -> str:
        """Keep what a newer session says until the one that is believed speaks, or is dead."""
        if self.second(now_s):
            return self._another(topic, self._age(session), now_s)
        if self._newcomer is None or self._newcomer.session != session:
            self._newcomer = _Newcomer(session, now_s)
        if len(self._newcomer.kept) < _MOST_KEPT:
            self._newcomer.kept.append(take)
        return ''

    def _age(self, session: int) -> str:
        if not session:
            return 'does not say when it started'
        started = time.strftime('%H:%M:%S on %Y-%m-%d', time.localtime(1e-9 * session))
        return f'started at {started}'

    def _another(self, topic: str, which: str, now_s: float) -> str:
        believed = (
            'none is believed yet'
            if self._session is None
            else f'the one that is believed {self._age(self._session)}'
        )
        text = f'a second source speaks for {self._part} on {topic}: it {which}, {believed}'
        self._second = (text, now_s)
        return text
