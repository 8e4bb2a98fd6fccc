"""Batches of boxes in a viser scene: one mesh and one set of lines for each batch."""

from __future__ import annotations

import numpy as np
import viser

from pack_cell.view.scene import Batch

_CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_FACES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip
_EDGE_COLOUR = (60, 45, 30)


class DrawnBatch:
    """One batch under ``name``, see-through with an ``opacity``; changed in place.

    A node that is made anew is not seen until the browser has it ready, and boxes on a belt move
    ten times a second.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        *,
        opacity: float | None = None,
        with_edges: bool = True,
    ) -> None:
        self._scene, self._name = server.scene, name
        self._opacity, self._with_edges = opacity, with_edges
        self._boxes: viser.BatchedMeshHandle | None = None
        self._edges: viser.LineSegmentsHandle | None = None
        self._shown: Batch | None = None

    def show(self, batch: Batch) -> None:
        """Show ``batch`` in place of what was there."""
        if self._shown is not None and self._shown.is_same(batch):
            return
        self._shown = batch
        if not len(batch):
            self._remove()
        elif self._boxes is None:
            self._make(batch)
        else:
            self._boxes.batched_positions = batch.centres.astype(np.float32)
            self._boxes.batched_wxyzs = batch.turns[:, [3, 0, 1, 2]].astype(np.float32)
            self._boxes.batched_scales = batch.sizes.astype(np.float32)
            self._boxes.batched_colors = _bytes(batch)
            if self._edges is not None:
                self._edges.points = batch.edges().astype(np.float32)

    def _make(self, batch: Batch) -> None:
        self._boxes = self._scene.add_batched_meshes_simple(
            f'/{self._name}/boxes',
            vertices=_CUBE,
            faces=_FACES,
            batched_wxyzs=batch.turns[:, [3, 0, 1, 2]],
            batched_positions=batch.centres,
            batched_scales=batch.sizes,
            batched_colors=_bytes(batch),
            opacity=self._opacity,
            flat_shading=True,
            lod='off',
            cast_shadow=self._opacity is None,
        )
        if self._with_edges:
            self._edges = self._scene.add_line_segments(
                f'/{self._name}/edges',
                points=batch.edges(),
                colors=_EDGE_COLOUR,
                thickness=1.0,
                thickness_units='screen',
            )

    def _remove(self) -> None:
        for handle in (self._boxes, self._edges):
            if handle is not None:
                handle.remove()
        self._boxes = self._edges = None


def _bytes(batch: Batch) -> np.ndarray:
    """Colours as the page draws those of a batch: linear ones, unlike those of all else (sRGB)."""
    shade = batch.colours
    linear = np.where(shade <= 0.04045, shade / 12.92, ((shade + 0.055) / 1.055) ** 2.4)
    made: np.ndarray = np.rint(255 * linear).astype(np.uint8)
    return made
