"""The benchmark with destinations: nothing is mis-sorted, nothing waits for ever, and it costs."""

from __future__ import annotations

from dataclasses import replace

import pytest

from pack_cell.bench.results import ResultFile
from pack_cell.bench.runner import Workers, run
from pack_cell.bench.simulator import pack_collection
from pack_cell.bench.streams import collection
from pack_cell.bench.values import BenchSettings, Case, CollectionSource
from pack_msgs_py.profiles import PROFILES
from pack_msgs_py.values import Box, parse_bin

SMALL = parse_bin('60x40x40')
SETTINGS = BenchSettings(PROFILES['paper'], open_bins=3)
CARTONS = tuple(
    Box(f'carton-{i}', size)
    for i, size in enumerate(
        [(200.0, 150.0, 100.0), (293.0, 188.5, 121.0), (100.0, 100.0, 100.0), (330.0, 250.0, 90.0)]
    )
)


def case(algorithm='mpack_lite', look_ahead=4, **changes):
    return Case(algorithm, SMALL, look_ahead, 1, CollectionSource('test', CARTONS), **changes)


def pack(destinations, asked=None, open_bins=3):
    """Events of a run; boxes are the same whatever the number of destinations."""
    settings = replace(SETTINGS, destinations=destinations, open_bins=open_bins)
    return pack_collection(asked or case(), settings, 0)


@pytest.mark.parametrize('algorithm', ['first_fit', 'o_best_fit', 'mpack_lite', 'walle'])
@pytest.mark.parametrize('destinations', [1, 2, 3, 7])
def test_every_box_goes_into_a_bin_of_its_destination_and_none_is_left(algorithm, destinations):
    packed = pack(destinations, case(algorithm))
    placed = [event for event in packed.events if event['event'] == 'place']
    assert len(placed) == packed.boxes and packed.unplaced == ()
    assert {event['box']['destination'] for event in placed} == {
        f'destination {k + 1}' for k in range(destinations)
    }
    for event in placed:
        assert event['box']['destination'] == event['bin_destination']


def test_boxes_are_the_same_with_and_without_destinations():
    with_one = collection(case(), replace(SETTINGS, destinations=3), 0)
    assert tuple(replace(box, destination='') for box in with_one) == collection(
        case(), SETTINGS, 0
    )
    assert with_one == collection(case('first_fit', 1), replace(SETTINGS, destinations=3), 0)


def test_one_destination_is_the_same_as_none():
    def plan(destinations):
        left_out = ('box', 'bin_destination', 'seconds')
        return [
            {key: value for key, value in event.items() if key not in left_out}
            for event in pack(destinations).events
        ]

    assert plan(1) == plan(0)


def test_bin_k_serves_destination_k_modulo_their_number():
    events = pack(2).events
    first = {}
    for event in events:
        first.setdefault(event['bin_serial'], event['bin_destination'])
    assert [first[serial] for serial in (1, 2, 3)] == [
        'destination 1', 'destination 2', 'destination 1',
    ]  # fmt: skip


def test_with_enough_bins_the_next_one_serves_whom_the_closed_one_did():
    serves = {event['bin_serial']: event['bin_destination'] for event in pack(3).events}
    closed = [event for event in pack(3).events if event['event'] == 'close']
    assert closed
    for number, event in enumerate(closed, start=4):
        if number in serves:
            assert serves[number] == event['bin_destination']


def test_a_box_with_no_open_bin_goes_round_and_blocks_nobody():
    # one open bin for two destinations: whoever is not served has to wait for a closed bin
    packed = pack(2, case(look_ahead=1), open_bins=1)
    waiting = list(collection(case(), replace(SETTINGS, destinations=2), 0))
    overtaken = 0
    for event in packed.events:
        if event['event'] == 'close':
            continue
        box = next(waits for waits in waiting if waits.id == event['box']['id'])
        ahead = waiting[: waiting.index(box)]
        assert all(passed.destination != box.destination for passed in ahead)
        overtaken += bool(ahead)
        waiting.remove(box)
    assert not waiting and overtaken > 0
    assert len({event['bin_destination'] for event in packed.events}) == 2


def test_a_bin_that_is_empty_is_given_to_another_destination_and_not_closed():
    packed = pack(9, case(look_ahead=2))
    closed = [event for event in packed.events if event['event'] == 'close']
    assert all(event['fill'] > 0 for event in closed)
    assert packed.closed_bins == len(closed)


def test_dedication_costs_fill():
    fills = [pack(count).fills['fill_closed'] for count in (1, 3)]
    assert fills[0] > fills[1] + 5


def test_a_record_says_how_many_destinations_there_were(tmp_path):
    results = ResultFile(tmp_path / 'r.json', tmp_path / 'p.jsonl')
    settings = replace(SETTINGS, destinations=3)
    (record,) = run([case('first_fit')], settings, Workers(), results, lambda *_: None)
    assert record['settings']['destinations'] == 3 and record['paper'] is None
    assert '"bin_destination": "destination 2"' in (tmp_path / 'p.jsonl').read_text()
    (pool,) = run([case('first_fit')], SETTINGS, Workers(), results, lambda *_: None)
    assert pool['settings']['destinations'] == 0 and pool != record
