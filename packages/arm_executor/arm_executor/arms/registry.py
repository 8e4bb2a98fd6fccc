"""The arms by name: those of this package, and those of other people.

An arm is a value of :class:`~arm_executor.arms.kind.ArmKind`. One of this package is one file and
one entry in :data:`ARMS`. One of another package is named by an entry point of the group
:data:`GROUP`, or by where it stands: ``module:attribute`` or ``folder/file.py:attribute``.
"""

from __future__ import annotations

from arm_executor.arms.kind import ArmKind
from arm_executor.arms.physics.kind import PHYSICS
from arm_executor.arms.timed_kind import TIMED
from arm_executor.arms.trajectory.kind import TRAJECTORY
from pack_msgs_py.plug_ins import load_plug_in, plug_ins_by_name

#: Entry points of this group name the arms of installed distributions.
GROUP = 'arm_executor.arms'

ARMS: tuple[ArmKind, ...] = (PHYSICS, TIMED, TRAJECTORY)
DEFAULT_ARM = ARMS[0].name
#: What may stand for an arm, for help and tables.
ARMS_IN_WORDS = (
    '; '.join(f'{kind.name} {kind.summary}' for kind in ARMS)
    + '; or module:attribute of an arm of your own'
)


def find_arm(name: str) -> ArmKind:
    """The arm called ``name``, or that stands at ``name``.

    Raises
    ------
    ValueError
        There is none; the message lists the known ones.
    """
    for kind in ARMS:
        if kind.name == name:
            return kind
    plug_ins = plug_ins_by_name(GROUP)
    where = plug_ins.get(name, name)
    if ':' not in where:
        known = [*(kind.name for kind in ARMS), *plug_ins]
        msg = (
            f'unknown arm {name!r}: use one of {", ".join(known)}, '
            'or module:attribute of an arm of your own'
        )
        raise ValueError(msg)
    plug_in = load_plug_in(where)
    if not isinstance(plug_in, ArmKind):
        msg = (
            f'arm {name!r} is {plug_in!r}; it must be an ArmKind, '
            'see docs/integration.md, Your own arm'
        )
        raise ValueError(msg)
    return plug_in
