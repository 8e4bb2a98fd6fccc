"""The scanner says what it measures; the true box stays with the physics."""

import math
import statistics
from dataclasses import replace

import pytest
from conveyor_rig import SIZE, ConveyorRig

from conveyor_sim.scanning.scanner import Scanner, ScannerNoise
from pack_msgs_py.values import Box, check_box

BOX = Box('b', SIZE, 2.0, com_offset_mm=(149.9, 0.0, 0.0))


def test_a_scanner_without_noise_is_right():
    assert Scanner().measure(BOX, 3) == BOX


def test_edges_and_weight_are_off_as_much_as_asked_and_the_deviation_is_told():
    scanner = Scanner(ScannerNoise(2.0, 0.05, 0.5), seed=1)
    seen = [scanner.measure(BOX, n) for n in range(4000)]
    for axis in range(3):
        errors = [box.size_mm[axis] - SIZE[axis] for box in seen]
        assert statistics.fmean(errors) == pytest.approx(0.0, abs=0.15)
        assert statistics.pstdev(errors) == pytest.approx(2.0, rel=0.05)
        assert max(map(abs, errors)) <= 8.1
    weights = [box.weight_kg - 2.0 for box in seen]
    assert statistics.pstdev(weights) == pytest.approx(0.05, rel=0.05)
    yaws = [scanner.yaw_rad(n) for n in range(4000)]
    assert statistics.pstdev(yaws) == pytest.approx(math.radians(0.5), rel=0.05)
    for box in seen[:20]:
        assert box.size_stddev_mm == (2.0, 2.0, 2.0)
        assert box.yaw_stddev_rad == pytest.approx(math.radians(0.5))


def test_a_second_scan_is_another_measurement_and_each_can_be_repeated():
    scanner, again = (Scanner(ScannerNoise(2.0, 0.05, 0.5), seed=4) for _ in range(2))
    assert scanner.measure(BOX, 7, 1) == again.measure(BOX, 7, 1)
    assert scanner.measure(BOX, 7, 1) != scanner.measure(BOX, 7, 2)
    assert scanner.measure(BOX, 7, 1) != Scanner(ScannerNoise(2.0), seed=5).measure(BOX, 7, 1)


def test_what_a_noisy_scanner_says_of_a_tiny_box_is_still_a_box():
    tiny = Box('t', (3.0, 2.0, 1.0), 0.002)
    for ordinal in range(500):
        check_box(Scanner(ScannerNoise(5.0, 0.5), seed=1).measure(tiny, ordinal))
        check_box(Scanner(ScannerNoise(5.0), seed=1).measure(BOX, ordinal))


def test_the_scan_tells_what_was_measured_and_the_physics_what_is_true():
    rows = tuple(replace(BOX, id=f'b{n}', com_offset_mm=(0.0, 0.0, 0.0)) for n in range(5))
    cell = ConveyorRig(rows, size_sigma=2.0, weight_sigma=0.02, yaw_sigma=0.5, seed=2)
    true = {scanned.box.id: scanned for scanned in cell.conveyor.true_boxes(cell.now)}
    for item in cell.scan().boxes:
        assert item.box.size_mm != SIZE
        assert item.box.size_stddev_mm == (2.0, 2.0, 2.0)
        assert item.box.yaw_stddev_rad == pytest.approx(math.radians(0.5))
        assert true[item.box.id].box in rows
        x, y, z = true[item.box.id].pose.position
        assert (x, y, z) == pytest.approx((0.0, 0.55 + 0.1, 0.75 + 0.05))
        assert true[item.box.id].pose.quaternion[2] != 0.0
    assert cell.scan().boxes[0].box == cell.scan().boxes[0].box
