"""The benchmark on a Dask cluster: the same result, and what happens when parts of it go away."""

from __future__ import annotations

import json
import os
import signal
import socket
import sys
from dataclasses import replace

import pytest
from distributed import LocalCluster

from pack_cell.bench import cluster
from pack_cell.bench.cluster import ClusterLost, check_address
from pack_cell.bench.results import UNFINISHED, ResultFile
from pack_cell.bench.runner import Workers, run
from pack_cell.bench.values import BenchSettings, Case, CollectionSource
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Box, parse_bin
from pack_planner.algorithms import find_algorithm

SETTINGS = BenchSettings(PROFILES['paper'])
CARTONS = tuple(
    Box(f'carton-{i}', size)
    for i, size in enumerate([(200.0, 150.0, 100.0), (293.0, 188.5, 121.0), (330.0, 250.0, 90.0)])
)
CASES = [
    Case(name, parse_bin('60x40x40'), 3, 6, CollectionSource('test', CARTONS))
    for name in ('first_fit', 'mpack_lite')
]


def nothing(*_):
    """No progress to show."""


def bench(folder, name, workers, progress=nothing):
    """Records and plan without what depends on the moment."""
    results = ResultFile(folder / f'{name}.json', folder / f'{name}.jsonl')
    try:
        records = run(CASES, SETTINGS, workers, results, progress)
    finally:
        results.close()
    lines = [json.loads(line) for line in (folder / f'{name}.jsonl').read_text().splitlines()]
    plan = [{**line, 'seconds': 0} for line in lines]
    return [{**record, 'decision_s': 0} for record in records], plan


@pytest.fixture(scope='module')
def wanted(tmp_path_factory):
    return bench(tmp_path_factory.mktemp('here'), 'here', Workers())


def local_cluster(count, **options):
    return LocalCluster(n_workers=count, threads_per_worker=1, dashboard_address=None, **options)


def in_this_process(count):
    return local_cluster(count, processes=False, protocol='tcp')


@pytest.mark.slow
def test_two_workers_give_the_same_plan_even_when_one_is_killed_half_way(tmp_path, wanted):
    killed = []
    with local_cluster(2) as dask:

        def kill_one(_case, _done, _total):
            if not killed:
                killed.append(dask.workers[0].pid)
                os.kill(killed[0], signal.SIGKILL)

        workers = Workers(cluster=dask.scheduler_address)
        assert bench(tmp_path, 'cluster', workers, kill_one) == wanted
    assert killed


@pytest.mark.slow
def test_a_worker_reads_an_algorithm_of_ones_own(tmp_path, wanted):
    path = tmp_path / 'mine.py'
    path.write_text(
        'from pack_planner import find_algorithm\n'
        "def my_rule(problem): return find_algorithm('first_fit')(problem)\n"
    )
    where = f'{path}:my_rule'
    own = replace(CASES[0], algorithm=where, digest=find_algorithm(where).digest)
    with local_cluster(1) as dask:
        results = ResultFile(None, None)
        workers = Workers(cluster=dask.scheduler_address)
        (record,) = run([own], SETTINGS, workers, results, nothing)
    assert record['algorithm'] == 'mine.py:my_rule'
    assert record['fill_closed'] == wanted[0][0]['fill_closed']


def test_without_its_scheduler_a_run_ends_and_goes_on_from_there(tmp_path, wanted):
    closed = []
    with in_this_process(2) as dask:

        def close(_case, _done, _total):
            if not closed:
                closed.append(True)
                dask.close()

        with pytest.raises(ClusterLost, match='is gone'):
            bench(tmp_path, 'lost', Workers(cluster=dask.scheduler_address), close)
    assert (tmp_path / f'lost.json{UNFINISHED}').exists()
    assert bench(tmp_path, 'lost', Workers()) == wanted


@pytest.mark.parametrize(
    'address', ['', ' ', 'garbage', 'localhost:8786', 'tcp://', 'tcp://host', 'tcp://host:0',
                'tcp://host:99999', 'http://host:8786', 'tls://host:8786', 'tcp://a b:1'],
)  # fmt: skip
def test_an_address_is_checked(address, tmp_path):
    with pytest.raises(ValueError, match=r'is no address such as tcp://127\.0\.0\.1:8786'):
        bench(tmp_path, 'x', Workers(cluster=address))


def test_addresses_by_name_and_number_are_taken():
    for address in ('tcp://10.0.0.1:8786', 'tcp://dask.example.org:1', 'tcp://[::1]:8786'):
        assert check_address(address) == address


def test_what_does_not_answer_like_a_scheduler_is_refused_in_time(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, 'ANSWER_S', 1)
    with socket.create_server(('127.0.0.1', 0)) as silent:
        address = f'tcp://127.0.0.1:{silent.getsockname()[1]}'
        with pytest.raises(ValueError, match='no Dask scheduler answers there'):
            bench(tmp_path, 'x', Workers(cluster=address))


def test_a_worker_is_no_scheduler_and_a_scheduler_needs_workers(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, 'WORKER_S', 1)
    with in_this_process(0) as empty, pytest.raises(ValueError, match='has no workers'):
        bench(tmp_path, 'x', Workers(cluster=empty.scheduler_address))
    text = 'there is a Dask Worker and no scheduler'
    with in_this_process(1) as alone, pytest.raises(ValueError, match=text):
        bench(tmp_path, 'x', Workers(cluster=alone.workers[0].address))


def test_without_dask_the_error_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, 'distributed', None)
    with pytest.raises(ValueError, match=r"pip install 'dask\[distributed\]'"):
        bench(tmp_path, 'x', Workers(cluster='tcp://127.0.0.1:1'))
