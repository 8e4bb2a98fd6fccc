"""Masses, centres of mass and inertia tensors of the arms' six moving links.

Published: all masses and centres of mass (Universal Robots, 'DH parameters for calculations of
kinematics and dynamics', as turned into URDF link frames by Universal Robots' ROS 2 description,
`config/<arm>/physical_parameters.yaml`, 2024-10), and the tensors of UR10e, UR16e and UR20 (same
file). Estimated: the tensors of UR5e (there a cylinder of each link's mass and size, which that
file uses too) and of UR30, for which the file repeats those of the much lighter UR16e: here they
are the UR20's, whose joints the UR30 shares, upper arm and forearm scaled by mass and by the square
of their length.

Kilograms, metres, kg m2. A tensor (ixx, ixy, ixz, iyy, iyz, izz) is about the centre of mass, its
axes turned about the link frame's x by ``roll``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pack_msgs_py.values import Vec3

Tensor = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class LinkInertia:
    """How a link resists; see the module's docstring."""

    mass: float
    centre: Vec3
    tensor: Tensor
    roll: float = 0.0


SixLinks = tuple[LinkInertia, LinkInertia, LinkInertia, LinkInertia, LinkInertia, LinkInertia]

#: Turns of the tensors of shoulder and wrists 1 and 2 in the published files.
_UP, _DOWN = math.pi / 2, -math.pi / 2

_UR5E: SixLinks = (
    LinkInertia(3.761, (0.0, -0.00193, -0.02561), (0.0102675, 0.0, 0.0, 0.0102675, 0.0, 0.00666)),
    LinkInertia(8.058, (-0.2125, 0.0, 0.11336), (0.0151074, 0.0, 0.0, 0.1338858, 0.0, 0.1338858)),
    LinkInertia(2.846, (-0.2422, 0.0, 0.0265), (0.004095, 0.0, 0.0, 0.0312094, 0.0, 0.0312094)),
    LinkInertia(1.37, (0.0, -0.01634, -0.0018), (0.0025599, 0.0, 0.0, 0.0025599, 0.0, 0.0021942)),
    LinkInertia(1.3, (0.0, 0.01634, -0.0018), (0.0025599, 0.0, 0.0, 0.0025599, 0.0, 0.0021942)),
    LinkInertia(0.365, (0.0, 0.0, -0.001159), (0.0000989, 0.0, 0.0, 0.0000989, 0.0, 0.0001321)),
)
_UR10E: SixLinks = (
    LinkInertia(
        7.369, (0.021, -0.027, 0.0), (0.03408, 0.00002, -0.00425, 0.03529, 0.00008, 0.02156), _UP
    ),
    LinkInertia(
        13.051, (-0.2327, 0.0, 0.158), (0.02814, 0.00005, -0.01561, 0.77068, 0.00002, 0.76943)
    ),
    LinkInertia(3.989, (-0.33155, 0.0, 0.068), (0.01014, 0.00008, 0.00916, 0.30928, 0.0, 0.30646)),
    LinkInertia(
        2.1, (0.0, -0.018, 0.007), (0.00296, -0.00001, 0.0, 0.00222, -0.00024, 0.00258), _UP
    ),
    LinkInertia(
        1.98, (0.0, 0.018, -0.007), (0.00296, -0.00001, 0.0, 0.00222, -0.00024, 0.00258), _DOWN
    ),
    LinkInertia(0.615, (0.0, 0.0, -0.026), (0.0004, 0.0, 0.0, 0.00041, 0.0, 0.00034)),
)
_UR16E: SixLinks = (
    LinkInertia(
        7.369, (0.0, -0.03, -0.016), (0.03351, 0.00002, -0.00001, 0.03374, 0.00374, 0.021), _UP
    ),
    LinkInertia(
        10.45, (-0.1764, 0.0, 0.16), (0.02796, -0.0001, -0.0072, 0.47558, 0.00003, 0.47635)
    ),
    LinkInertia(4.321, (-0.166, 0.0, 0.065), (0.01091, 0.00006, 0.01012, 0.1206, 0.00001, 0.11714)),
    LinkInertia(
        2.18, (0.0, -0.011, -0.009), (0.00609, -0.00001, 0.0, 0.00245, 0.00083, 0.00579), _UP
    ),
    LinkInertia(
        2.033, (0.0, 0.012, -0.018), (0.00389, -0.00001, 0.0, 0.00219, -0.00045, 0.00363), _DOWN
    ),
    LinkInertia(0.907, (0.0, 0.0, -0.044), (0.00117, 0.0, 0.0, 0.00118, 0.0, 0.00084)),
)
_UR20: SixLinks = (
    LinkInertia(
        16.343, (0.0, -0.0062, -0.061), (0.08866, -0.00011, -0.00011, 0.07632, 0.0072, 0.08418), _UP
    ),
    LinkInertia(
        29.632, (-0.3394, 0.0, 0.2098), (0.1467, 0.00019, -0.05163, 4.6659, 0.00004, 4.6348)
    ),
    LinkInertia(
        7.879, (-0.4053, 0.0, 0.0604), (0.02612, -0.00005, -0.02898, 0.75763, -0.00001, 0.75327)
    ),
    LinkInertia(
        3.054,
        (0.0, -0.0393, -0.0026),
        (0.00555, -0.00001, -0.00002, 0.00537, 0.00036, 0.00402),
        _UP,
    ),
    LinkInertia(
        3.126,
        (0.0, 0.0379, -0.0024),
        (0.00586, -0.00001, -0.00002, 0.00578, -0.00037, 0.00427),
        _DOWN,
    ),
    LinkInertia(0.926, (0.0, 0.0, -0.0293), (0.00092, 0.0, 0.0, 0.00091, 0.0, 0.00117)),
)


def _shortened(link: LinkInertia, mass: float, centre: Vec3, share: float) -> LinkInertia:
    """``link`` at ``share`` of its length (along x): tensor by mass, and by length squared."""
    by_mass = mass / link.mass
    ixx, ixy, ixz, iyy, iyz, izz = (moment * by_mass for moment in link.tensor)
    along = share * share
    tensor = (
        ixx,
        ixy * share,
        ixz * share,
        ixx + (iyy - ixx) * along,
        iyz,
        ixx + (izz - ixx) * along,
    )
    return LinkInertia(mass, centre, tensor)


_UR30: SixLinks = (
    replace(_UR20[0], centre=(-0.0001, -0.0069, -0.06)),
    _shortened(_UR20[1], 28.542, (-0.2476, 0.0, 0.2103), 0.637 / 0.862),
    _shortened(_UR20[2], 7.156, (-0.278, 0.0, 0.0629), 0.5037 / 0.7287),
    replace(_UR20[3], centre=(0.0, -0.0353, -0.0048)),
    replace(_UR20[4], centre=(0.0, 0.0341, -0.0046)),
    _UR20[5],
)

INERTIAS: dict[str, SixLinks] = {
    'ur5e': _UR5E,
    'ur10e': _UR10E,
    'ur16e': _UR16E,
    'ur20': _UR20,
    'ur30': _UR30,
}
