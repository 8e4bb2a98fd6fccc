"""The last seconds of every topic, and what was said last on those that were silent."""

from __future__ import annotations

from collections import deque

from pack_cell.recording.messages import RecordedMessage, RecordedTopic

#: What is kept at most, whatever is said in that time.
MOST_BYTES = 64 * 1024 * 1024


class FlightBuffer:
    """Keeps what was heard in the last ``keep_s`` seconds, and the last message of each topic."""

    def __init__(self, keep_s: float) -> None:
        self._keep_ns = round(1e9 * keep_s)
        self._recent: deque[RecordedMessage] = deque()
        self._bytes = 0
        self._before: dict[RecordedTopic, RecordedMessage] = {}

    def add(self, message: RecordedMessage) -> None:
        """A message that has just been heard."""
        self._recent.append(message)
        self._bytes += len(message.data)
        oldest_ns = message.heard_ns - self._keep_ns
        while self._recent[0].heard_ns < oldest_ns or self._bytes > MOST_BYTES:
            old = self._recent.popleft()
            self._bytes -= len(old.data)
            self._before[old.topic] = old
            if not self._recent:
                break

    def content(self) -> list[RecordedMessage]:
        """What is kept, oldest first."""
        return [*sorted(self._before.values(), key=lambda old: old.heard_ns), *self._recent]
