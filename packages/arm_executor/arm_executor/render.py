"""Pictures of the cell for reports, drawn in software."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import pybullet

from arm_executor.world import PhysicsWorld

#: Camera over the infeed, looking at the rail; metres, frame `cell`, degrees.
_EYE, _LOOKS_AT, _FIELD_OF_VIEW = (2.2, 4.3, 3.9), (-0.03, 0.30, 0.74), 39.0


def save_picture(world: PhysicsWorld, path: Path, width: int, height: int) -> None:
    """Write a PNG of the whole cell from above and in front."""
    view = pybullet.computeViewMatrix(_EYE, _LOOKS_AT, (0, 0, 1))
    lens = pybullet.computeProjectionMatrixFOV(_FIELD_OF_VIEW, width / height, 0.5, 30.0)
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
        physicsClientId=world.client,
    )
    image = np.asarray(pixels, dtype=np.uint8).reshape(height, width, 4)[:, :, :3]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(_png(image))


def _png(image: np.ndarray[tuple[int, ...], np.dtype[np.uint8]]) -> bytes:
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
