"""One thread that computes decisions, so that callbacks and heartbeats never wait for one."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar('T')


class Worker(Generic[T]):
    """Runs jobs one after another in its own thread; results are fetched by the owner's thread.

    ``ready`` is called from the worker's thread each time a result can be fetched.
    """

    def __init__(self, ready: Callable[[], None], name: str = 'worker') -> None:
        self._ready = ready
        self._jobs: queue.SimpleQueue[Callable[[], T] | None] = queue.SimpleQueue()
        self._results: queue.SimpleQueue[T] = queue.SimpleQueue()
        self._stopped = threading.Event()
        self._submitted = self._done = 0
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def submit(self, job: Callable[[], T]) -> None:
        """Queue ``job``; it must not raise."""
        self._submitted += 1
        self._jobs.put(job)

    def fetch(self) -> list[T]:
        """Results that are ready, oldest first."""
        results = []
        while True:
            try:
                results.append(self._results.get_nowait())
            except queue.Empty:
                return results

    @property
    def is_busy(self) -> bool:
        """Whether a job is not done yet."""
        return self._done < self._submitted

    def stop(self, timeout_s: float) -> bool:
        """Let the running job end and drop the others; whether the thread ended in time."""
        self._stopped.set()
        self._jobs.put(None)
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while True:
            job = self._jobs.get()
            if job is None or self._stopped.is_set():
                return
            result = job()
            self._done += 1
            if self._stopped.is_set():
                return
            self._results.put(result)
            self._ready()
