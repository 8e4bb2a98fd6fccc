"""People put boxes into bins and take them out by hand; the arm in physics goes on with that."""

from __future__ import annotations

import pytest

pytest.importorskip('pybullet')
pytest.importorskip('toppra')

from executor_cases import make_box
from test_bin_work import SIZE, at, paused
from test_faults_physics import PhysicsBench

from pack_msgs_py.codes import ErrorCode

pytestmark = pytest.mark.physics

BELOW, ABOVE, BY_HAND, LAST = (make_box(number) for number in range(1, 5))
HALF_M = 0.5 * BELOW.size_mm[2] / 1000


@pytest.fixture
def bench():
    bench = PhysicsBench()
    yield bench
    bench.end()


def height_m(bench, box):
    return bench.book.state.poses[box.id].position[2]


def test_what_people_do_by_hand_is_in_the_world_of_the_arm(bench):
    def place(box, corner_mm):
        revision = bench.book.state.bins[0].revision
        return bench.place(box, corner_mm, revision=revision)

    assert place(BELOW, (0, 0, 0)).code is ErrorCode.NONE
    assert place(ABOVE, (0, 0, SIZE[2])).code is ErrorCode.NONE
    assert height_m(bench, ABOVE) == pytest.approx(3 * HALF_M, abs=0.005)

    work = paused(bench)
    assert work.remove(BELOW.id).endswith('it carried box-2: look how they stand now')
    bench.wait(lambda: height_m(bench, ABOVE) < 2 * HALF_M)
    assert height_m(bench, ABOVE) == pytest.approx(HALF_M, abs=0.005)

    work.insert('A', at(BY_HAND, (SIZE[0], 0, 0)))
    bench.core.panel.request('RESUME', '', 'anna', '', (True, ''))
    report = place(LAST, (SIZE[0], 0, SIZE[2]))
    while report.code is ErrorCode.STALE_BIN_REVISION:
        # The box that was put in is still being measured.
        report = place(LAST, (SIZE[0], 0, SIZE[2]))
    assert report.code is ErrorCode.NONE, report.message
    assert report.others_moved_m < 0.005
    assert bench.boxes() == [ABOVE.id, BY_HAND.id, LAST.id]
    assert height_m(bench, LAST) == pytest.approx(3 * HALF_M, abs=0.005)
