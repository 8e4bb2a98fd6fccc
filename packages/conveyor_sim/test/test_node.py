"""The node over ROS: what late joiners see, what events and services do, what restarts keep."""

from __future__ import annotations

import math
import re
import threading
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool

from conveyor_sim.ledger.ledger import LedgerError
from conveyor_sim.ros import node as conveyor_node
from conveyor_sim.ros.node import ConveyorNode
from pack_msgs.msg import BinState, BinStateArray, BoxEvent, PlacedBox, PlacementDecision
from pack_msgs.srv import InsertBox, RemoveBox
from pack_msgs_py.cell_values import BoxEvent as Event
from pack_msgs_py.cell_values import Decision
from pack_msgs_py.codes import BoxEventKind as Kind
from pack_msgs_py.codes import PlacementStatus, Reason
from pack_msgs_py.ros.conversions import box_to_ros, decision_to_ros, event_to_ros, time_to_ros
from pack_msgs_py.values import Box

pytestmark = pytest.mark.ros

PACKAGE = Path(__file__).parent.parent


def boxes_csv(folder, extra=''):
    path = folder / 'boxes.csv'
    rows = ''.join(f'b{n},300,200,100,1\n' for n in range(8))
    path.write_text('id,length_mm,width_mm,height_mm,weight_kg\n' + extra + rows)
    return str(path)


@pytest.fixture
def start(spinner, tmp_path):
    def _start(**parameters):
        if 'boxes_file' not in parameters:
            parameters['boxes_file'] = boxes_csv(tmp_path)
        parameters.setdefault('speed', 0.0)
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        return ConveyorNode(context=spinner.context, parameter_overrides=overrides)

    return lambda **parameters: spinner.add(_start(**parameters))


def ids(scan):
    return [item.box.id for item in scan.boxes]


def event(observer, box_id, kind, stamp=None):
    stamp_s = observer.stamp() if stamp is None else stamp
    observer.send('box_event', event_to_ros(Event(box_id, kind, stamp_s=stamp_s)))
    return stamp_s


def decide(observer, box_id, **changes):
    box = Box(box_id, (300.0, 200.0, 100.0))
    values = {'bin_id': 'LDC-1', 'sequence': 1, 'stamp_s': observer.stamp(), **changes}
    observer.send('placements', decision_to_ros(Decision(box, **values), 'bin_a'))


def test_a_late_joiner_gets_the_look_ahead(start, observer):
    start()
    scan = observer.wait_for(lambda scan: len(scan.boxes) == 5)
    assert ids(scan) == ['b0', 'b1', 'b2', 'b3', 'b4']
    assert (scan.supplied, scan.remaining) == (5, 3)
    assert scan.boxes[0].pick_open_s == pytest.approx(scan.stamp_s, abs=60.0)
    assert scan.boxes[0].pose.position == pytest.approx((0.0, 0.65, 0.8))


def test_the_scan_is_repeated_every_second(start, observer):
    start()
    first = observer.wait_for(lambda scan: True)
    later = observer.wait_for(lambda scan: scan.sequence >= first.sequence + 2)
    assert later.stamp_s - first.stamp_s < 2 + 1.0


def test_a_decision_brings_its_box_and_a_pick_is_refilled(start, observer):
    start()
    observer.wait_for(lambda scan: True)
    decide(observer, 'b3')
    scan = observer.wait_for(lambda scan: ids(scan)[0] == 'b3' and scan.boxes[0].pick_open_s)
    assert scan.boxes[0].travel_time_s == pytest.approx(2.4)
    event(observer, 'b3', Kind.PICKED)
    scan = observer.wait_for(lambda scan: 'b5' in ids(scan))
    assert 'b3' not in ids(scan)
    assert (len(scan.boxes), scan.supplied, scan.remaining) == (5, 6, 2)


def test_in_real_time_the_belt_is_seen_moving_and_arrives_when_it_should(start, observer):
    start(speed=8.0, rate=50.0)
    observer.wait_for(lambda scan: True)
    decide(observer, 'b3')
    scan = observer.wait_for(lambda scan: ids(scan)[0] == 'b3' and scan.boxes[0].pick_open_s)
    moving = [scan for scan in observer.scans if any(scan.belt_velocity)]
    assert len(moving) >= 5
    assert moving[0].belt_velocity == pytest.approx((0.0, -12.0, 0.0))
    assert 0.15 < scan.boxes[0].pick_open_s - moving[0].stamp_s < 0.32
    assert scan.stamp_s >= scan.boxes[0].pick_open_s


def test_a_returned_box_is_back_and_a_late_copy_of_picked_does_not_remove_it(start, observer):
    start()
    observer.wait_for(lambda scan: True)
    picked = event(observer, 'b0', Kind.PICKED)
    observer.wait_for(lambda scan: 'b0' not in ids(scan))
    event(observer, 'b0', Kind.RETURNED)
    observer.wait_for(lambda scan: ids(scan)[0] == 'b0')
    event(observer, 'b0', Kind.PICKED, stamp=picked)
    event(observer, 'b1', Kind.LOST)
    scan = observer.wait_for(lambda scan: 'b1' not in ids(scan))
    assert ids(scan)[0] == 'b0'


def test_a_rejected_box_goes_to_the_reject_lane_with_an_event(start, observer):
    start()
    observer.wait_for(lambda scan: True)
    decide(
        observer,
        'b2',
        bin_id='',
        status=PlacementStatus.REJECT,
        reason='fits no bin',
        reject_reason=Reason.OVERWEIGHT,
    )
    rejection = observer.wait_for_rejection('b2')
    assert (rejection.reason, rejection.text) == (BoxEvent.REASON_OVERWEIGHT, 'fits no bin')
    scan = observer.wait_for(lambda scan: 'b2' not in ids(scan))
    assert sorted(ids(scan)) == ['b0', 'b1', 'b3', 'b4', 'b5']


def test_a_bad_row_is_rejected_with_an_event_that_a_late_joiner_hears(start, observer, tmp_path):
    start(boxes_file=boxes_csv(tmp_path, 'bad,300,zero,100,1\n'))
    rejection = observer.wait_for_rejection('bad')
    assert rejection.reason == BoxEvent.REASON_INVALID_DATA
    for part in ('boxes.csv', 'line 2', 'width_mm', 'zero'):
        assert part in rejection.text
    assert observer.wait_for(lambda scan: True).supplied == 6


def test_a_box_that_a_bin_shows_is_not_on_the_belt(start, observer):
    start()
    observer.wait_for(lambda scan: True)
    standing, closed = PlacedBox(), PlacedBox()
    standing.box.id, closed.box.id = 'b0', 'b4'
    bins = BinStateArray(bins=[BinState(boxes=[PlacedBox(), standing])])
    bins.header.stamp = time_to_ros(observer.stamp())
    observer.send('bin_state', bins)
    observer.send('bin_closed', BinState(boxes=[closed]))
    scan = observer.wait_for(lambda scan: not {'b0', 'b4'} & set(ids(scan)))
    assert len(scan.boxes) == 5


def test_malformed_messages_are_ignored_and_the_next_good_one_counts(start, observer):
    start()
    observer.wait_for(lambda scan: True)
    bad = PlacementDecision(status=99)
    bad.placement.box.id, bad.placement.box.size.x = 'b1', math.nan
    observer.send('placements', bad)
    observer.send('box_event', BoxEvent(box_id='', event=1))
    observer.send('box_event', BoxEvent(box_id='b1', event=77))
    event(observer, 'b2', Kind.PICKED)
    scan = observer.wait_for(lambda scan: 'b2' not in ids(scan))
    assert 'b1' in ids(scan)


def call(observer, kind, name, request):
    client = observer.node.create_client(kind, name)
    assert client.wait_for_service(20.0)
    done = threading.Event()
    future = client.call_async(request)
    future.add_done_callback(lambda _: done.set())
    assert done.wait(20.0)
    return future.result()


def test_pause_stops_feeding_until_it_is_lifted(start, observer):
    start()
    assert call(observer, SetBool, 'conveyor/pause', SetBool.Request(data=True)).success
    event(observer, 'b0', Kind.PICKED)
    observer.wait_for(lambda scan: len(scan.boxes) == 4)
    assert call(observer, SetBool, 'conveyor/pause', SetBool.Request(data=False)).success
    observer.wait_for(lambda scan: len(scan.boxes) == 5)


def test_the_operator_lays_a_box_on_takes_one_away_and_drains_the_belt(start, observer):
    start()
    observer.wait_for(lambda scan: len(scan.boxes) == 5)
    mine = box_to_ros(Box('mine', (300.0, 200.0, 100.0), 2.5))
    assert call(observer, InsertBox, 'conveyor/insert_box', InsertBox.Request(box=mine)).success
    again = call(observer, InsertBox, 'conveyor/insert_box', InsertBox.Request(box=mine))
    assert (again.success, "'mine'" in again.message) == (False, True)
    nonsense = call(observer, InsertBox, 'conveyor/insert_box', InsertBox.Request())
    assert (nonsense.success, 'id' in nonsense.message) == (False, True)
    removed = RemoveBox.Request(box_id='b2')
    assert call(observer, RemoveBox, 'conveyor/remove_box', removed).success
    assert observer.wait_for_rejection('b2').reason == BoxEvent.REASON_OPERATOR
    assert not call(observer, RemoveBox, 'conveyor/remove_box', removed).success
    observer.wait_for(lambda scan: 'mine' in ids(scan))
    assert call(observer, SetBool, 'conveyor/drain', SetBool.Request(data=True)).success
    event(observer, 'b0', Kind.PICKED)
    observer.wait_for(lambda scan: len(scan.boxes) == 4 and scan.remaining == 3)


def test_a_running_belt_is_seen_running_with_a_window_for_every_box(start, observer):
    start(belt_mode='continuous', speed=4.0, rate=50.0)
    scan = observer.wait_for(lambda scan: len(scan.boxes) == 5)
    assert scan.belt_velocity == pytest.approx((0.0, -6.0, 0.0))
    assert all(item.pick_open_s > scan.stamp_s for item in scan.boxes)
    assert all(item.pick_close_s - item.pick_open_s == pytest.approx(3.0) for item in scan.boxes)
    chosen = scan.boxes[2].box.id
    decide(observer, chosen)
    held = lambda scan: scan.boxes[0].pick_open_s <= scan.stamp_s  # noqa: E731
    scan = observer.wait_for(held)
    assert scan.boxes[0].box.id == chosen
    assert scan.boxes[0].pose.position == pytest.approx((0.0, 0.65, 0.8))


def test_the_diagnostics_say_what_the_belt_does_and_where_the_boxes_are(start, observer):
    heard, news = [], threading.Event()

    def on_message(msg):
        heard.append({pair.key: pair.value for pair in msg.status[0].values})
        news.set()

    observer.node.create_subscription(DiagnosticArray, '/diagnostics', on_message, 10)
    start()
    assert news.wait(20.0)
    assert (heard[0]['belt'], heard[0]['on_belt'], heard[0]['supplied']) == ('running', '5', '5')


def test_speed_can_be_set_while_running_but_not_to_nonsense(start, observer):
    node = start(speed=1.0)

    def request(name, value):
        message = SetParameters.Request(
            parameters=[Parameter(name, value=value).to_parameter_msg()]
        )
        return call(observer, SetParameters, 'conveyor/set_parameters', message).results[0]

    assert request('speed', 0.0).successful
    decide(observer, 'b3')
    observer.wait_for(lambda scan: ids(scan)[0] == 'b3')
    for name, value in (
        ('speed', -1.0),
        ('speed', math.nan),
        ('belt_speed', 0.0),
        ('look_ahead', 3),
        ('rate', 0.0),
    ):
        assert not request(name, value).successful
    assert node.get_parameter('speed').value == 0.0


def test_a_restarted_node_goes_on_where_it_was(start, spinner, observer, tmp_path):
    state = str(tmp_path / 'state')
    node = start(state_dir=state)
    observer.wait_for(lambda scan: True)
    event(observer, 'b0', Kind.PICKED)
    before = observer.wait_for(lambda scan: 'b5' in ids(scan))
    with pytest.raises(LedgerError, match='in use'):
        start(state_dir=state)
    spinner.executor.remove_node(node)
    node.destroy_node()
    start(state_dir=state)
    after = observer.wait_for(lambda scan: scan.sequence > before.sequence + 100)
    assert ids(after) == ids(before)
    assert (after.supplied, after.remaining) == (before.supplied, before.remaining)


@pytest.mark.parametrize(
    ('parameters', 'words'),
    [
        ({'look_ahead': 0}, 'look_ahead is 0'),
        ({'look_ahead': 7}, 'look_ahead is 7'),
        ({'speed': math.nan}, 'finite'),
        ({'belt_sped': 1.0}, 'belt_sped'),
        ({'boxes_file': '/nowhere.csv'}, '/nowhere.csv'),
    ],
)
def test_a_wrong_parameter_is_named(start, parameters, words):
    with pytest.raises(ValueError, match=words):
        start(**parameters)


def test_the_readme_names_every_topic_and_service_of_the_node():
    readme = (PACKAGE / 'README.md').read_text()
    for name in re.findall(r'`([a-z_~/]+)` \(', conveyor_node.__doc__):
        assert f'`{name}`' in readme
