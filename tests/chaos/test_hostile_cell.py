"""A node that is told hostile things, by somebody whom it has to believe, lives and answers."""

from __future__ import annotations

from pathlib import Path

import pytest
from ament_index_python.packages import get_package_share_directory

from pack_cell.chaos.lone_node import PARAMETERS, attack_alone

pytestmark = pytest.mark.cell

#: About 2000 in all; `cell chaos --messages` tells as many as one likes.
TOLD = 330
#: Within other messages, or told to nobody by the cell.
INSIDE = {
    *('Alarm', 'Box', 'NodeState', 'PlacedBox', 'Placement', 'PlacementCheck', 'RunnerUp'),
    *('ScannedBox', 'Source', 'CellState'),
}

ATTACKED: set[str] = set()


@pytest.mark.parametrize('name', list(PARAMETERS))
def test_a_node_alone_survives_hostile_things(name: str, tmp_path: Path, ros_domain: int) -> None:
    node = attack_alone(name, TOLD, seed=7, folder=tmp_path, domain=ros_domain)
    ATTACKED.update(node.types)
    assert node.wrong == []
    assert sum(node.sent.values()) >= TOLD


def test_there_is_no_interface_that_no_node_is_attacked_on() -> None:
    if not ATTACKED:
        pytest.skip('only together with the attacks')
    share = Path(get_package_share_directory('pack_msgs'))
    installed = {
        f'pack_msgs/{kind}/{path.stem}'
        for kind in ('msg', 'srv', 'action')
        for path in (share / kind).glob(f'*.{kind}')
    }
    assert installed
    assert installed - {f'pack_msgs/msg/{name}' for name in INSIDE} <= ATTACKED
