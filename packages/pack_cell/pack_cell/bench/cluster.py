"""A Dask cluster as the place where joblib packs collections."""

from __future__ import annotations

import asyncio
import logging
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

#: How long a scheduler may take to answer, and to have a worker, seconds.
ANSWER_S, WORKER_S = 10, 30

_NO_WORKER_PERIOD_S = 5.0

HELP = (
    '--cluster needs dask and distributed: install them with '
    "`./cell python -m pip install 'dask[distributed]'`"
)

_ADDRESS = re.compile(r'^tcp://(\[[0-9a-fA-F:.]+\]|[^\s:/\[\]]+):(\d{1,5})$')


class ClusterLost(RuntimeError):
    """The cluster went away while it was working."""


def check_address(address: str) -> str:
    """``address`` if it names a scheduler; ``ValueError`` says what it should look like."""
    match = _ADDRESS.match(address)
    if match is None or not 1 <= int(match[2]) <= 65535:
        msg = f'--cluster {address!r} is no address such as tcp://127.0.0.1:8786'
        raise ValueError(msg)
    return address


@contextmanager
def dask_cluster(address: str, note: Callable[[str], None]) -> Iterator[None]:
    """Let joblib use the workers of the scheduler at ``address``.

    What a worker that dies was packing goes to the others; ``note`` is told when none is left.

    Raises
    ------
    ValueError
        There is no scheduler, or it has no workers.
    ClusterLost
        The scheduler, or what it ran, is gone.
    """
    check_address(address)
    try:
        from distributed import Client, KilledWorker
        from distributed.client import FutureCancelledError
        from distributed.comm import CommClosedError
    except ImportError:
        raise ValueError(HELP) from None
    from joblib import parallel_config

    _silence()
    _probe(address)
    with Client(address, timeout=f'{ANSWER_S}s') as client:
        try:
            client.wait_for_workers(1, timeout=WORKER_S)
        except TimeoutError:
            msg = f'--cluster {address} has no workers; start some with `dask worker {address}`'
            raise ValueError(msg) from None
        done = threading.Event()
        watch = threading.Thread(target=_watch, args=(client, address, note, done), daemon=True)
        watch.start()
        try:
            with parallel_config(backend='dask', client=client):
                yield
        except (FutureCancelledError, CommClosedError) as error:
            msg = f'the scheduler at {address} is gone'
            raise ClusterLost(msg) from error
        except KilledWorker as error:
            msg = f'several workers of {address} died while they packed the same collection'
            raise ClusterLost(msg) from error
        finally:
            done.set()


def _silence() -> None:
    """Keep ``distributed`` from logging tracebacks of what is said here in a sentence."""
    loggers = [name for name in logging.root.manager.loggerDict if name.startswith('distributed')]
    for name in loggers:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)


def _probe(address: str) -> None:
    """Refuse what is no scheduler; a client would wait for ever for the answer of a web server."""
    from distributed import rpc

    async def ask() -> str:
        async with rpc(address) as server:
            return str((await server.identity()).get('type'))

    try:
        kind = asyncio.run(asyncio.wait_for(ask(), ANSWER_S))
    except (OSError, ValueError, asyncio.TimeoutError) as error:
        msg = f'--cluster {address}: no Dask scheduler answers there'
        raise ValueError(f'{msg}: {error}' if str(error) else msg) from None
    if kind != 'Scheduler':
        msg = f'--cluster {address}: there is a Dask {kind} and no scheduler'
        raise ValueError(msg)


def _watch(
    client: Any,  # noqa: ANN401 - distributed has no types
    address: str,
    note: Callable[[str], None],
    done: threading.Event,
) -> None:
    """Say so when there is nobody left to work."""
    before = True
    while not done.wait(_NO_WORKER_PERIOD_S):
        now = bool(client.scheduler_info().get('workers'))
        if before and not now:
            note(f'no worker is left at {address}; waiting for one, Ctrl-C ends')
        before = now
