"""Pictures of the cell for reports, drawn in software."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pybullet
from numpy.typing import NDArray

from arm_executor.arms.physics.world import PhysicsWorld
from pack_msgs_py.values import Vec3


@dataclass(frozen=True)
class Camera:
    """Where it is and what it looks at, metres, frame `cell`; field of view in degrees.

    By default over the infeed, looking at the rail.
    """

    eye: Vec3 = (2.2, 4.3, 3.9)
    looks_at: Vec3 = (-0.03, 0.30, 0.74)
    field_of_view: float = 39.0


def save_picture(
    world: PhysicsWorld, path: Path, width: int, height: int, camera: Camera | None = None
) -> None:
    """Write a PNG of ``world`` to ``path``, ``width`` by ``height`` pixels.

    It shows the whole cell unless ``camera`` says otherwise.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(png_of(take_picture(world.client, width, height, camera or Camera())))


def take_picture(client: int, width: int, height: int, camera: Camera) -> NDArray[np.uint8]:
    """What ``camera`` sees of the physics client ``client``, (height, width, 3)."""
    view = pybullet.computeViewMatrix(camera.eye, camera.looks_at, (0, 0, 1))
    lens = pybullet.computeProjectionMatrixFOV(camera.field_of_view, width / height, 0.5, 30.0)
    _, _, pixels, _, _ = pybullet.getCameraImage(
        width,
        height,
        viewMatrix=view,
        projectionMatrix=lens,
        lightDirection=(1.5, 2.5, 6.0),
        lightDistance=8.0,
        lightAmbientCoeff=0.55,
        lightDiffuseCoeff=0.45,
        lightSpecularCoeff=0.1,
        shadow=1,
        renderer=pybullet.ER_TINY_RENDERER,
        physicsClientId=client,
    )
    return np.asarray(pixels, dtype=np.uint8).reshape(height, width, 4)[:, :, :3]


def png_of(image: NDArray[np.uint8]) -> bytes:
    """``image`` (height, width, 3) as PNG."""
    height, width, _ = image.shape
    rows = b''.join(b'\x00' + row.tobytes() for row in image)

    def chunk(kind: bytes, data: bytes) -> bytes:
        body = kind + data
        return struct.pack('>I', len(data)) + body + struct.pack('>I', zlib.crc32(body))

    header = struct.pack('>IIBBBBB', width, height, 8, 2, 0, 0, 0)
    return (
        b'\x89PNG\r\n\x1a\n'
        + chunk(b'IHDR', header)
        + chunk(b'IDAT', zlib.compress(rows, 9))
        + chunk(b'IEND', b'')
    )
