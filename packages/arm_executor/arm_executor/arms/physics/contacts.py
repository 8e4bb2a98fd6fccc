"""What the arm runs into: contacts in physics that no motion means to make."""

from __future__ import annotations

from collections import defaultdict

import pybullet

from arm_executor.arms.physics.world import PhysicsWorld

#: Force with which a link may touch anything but the box that it handles, newtons.
LINK_FORCE_N = 5.0
#: Force beyond its weight with which the held box may rest on, or slide along, others, newtons.
BOX_FORCE_N = 150.0


def touched_by(world: PhysicsWorld, box_id: str) -> str:
    """Names of what a box touches, the arm excepted; for people."""
    contacts = pybullet.getContactPoints(
        bodyA=world.boxes[box_id].number, physicsClientId=world.client
    )
    others = {contact[2] for contact in contacts} - {world.robot}
    return ', '.join(sorted(world.name_of(number) for number in others)) or 'nothing'


def collision(world: PhysicsWorld, box_id: str, weight_n: float, *, held: bool) -> str | None:
    """What touches what with which force, ``None`` when nothing does that should not.

    ``box_id`` is the box that the arm handles: links may touch it, and while it is ``held`` it may
    press on what it stands on.
    """
    body = world.boxes.get(box_id)
    number = -1 if body is None else body.number
    links = {number: name for name, number in world.links.items()}
    for contact in pybullet.getContactPoints(bodyA=world.robot, physicsClientId=world.client):
        other, link, force = contact[2], contact[3], contact[9]
        if other not in (world.robot, number) and force > LINK_FORCE_N:
            return f'{links[link]} pressed on {world.name_of(other)} with {force:.0f} N'
    if held and number >= 0:
        forces: dict[int, float] = defaultdict(float)
        for contact in pybullet.getContactPoints(bodyA=number, physicsClientId=world.client):
            if contact[2] != world.robot:
                forces[contact[2]] += contact[9]
        worst = max(forces, key=lambda other: forces[other], default=None)
        if worst is not None and forces[worst] > weight_n + BOX_FORCE_N:
            return f'box {box_id} pressed on {world.name_of(worst)} with {forces[worst]:.0f} N'
    return None
