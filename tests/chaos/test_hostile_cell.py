"""A node that is told hostile things, by somebody whom it has to believe, lives and answers."""

from __future__ import annotations

from pathlib import Path

import pytest

from pack_cell.chaos.lone_node import PARAMETERS, attack_alone

pytestmark = pytest.mark.cell

#: About 2000 in all; `cell chaos --messages` tells as many as one likes.
TOLD = 660


@pytest.mark.parametrize('name', list(PARAMETERS))
def test_a_node_alone_survives_hostile_things(name: str, tmp_path: Path, ros_domain: int) -> None:
    node = attack_alone(name, TOLD, seed=7, folder=tmp_path, domain=ros_domain)
    assert node.wrong == []
    assert sum(node.sent.values()) == TOLD
