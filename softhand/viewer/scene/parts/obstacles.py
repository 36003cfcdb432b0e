"""The obstacles in the picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softhand.model.shapes.shape import Shape
from softhand.viewer.scene.item import Part, Update, item
from softhand.viewer.scene.moment import Moment, Past
from softhand.viewer.scene.palette import TABLE, darker
from softhand.viewer.scene.shapes.edges import feature_edges
from softhand.viewer.scene.shapes.placed import placed_mesh


class Obstacles(Part):
    """Bodies that stand still, to be seen through, with their edges."""

    def __init__(self, obstacles: Sequence[tuple[str, Shape]], unit: float) -> None:
        self.items = []
        for name, shape in obstacles:
            mesh = placed_mesh(shape)
            self.items.append(item(f"obstacles/{name}", mesh, TABLE, opacity=0.4))
            edges = feature_edges(mesh, 0.035 * unit)
            if len(edges.faces):
                self.items.append(item(f"obstacles/{name} edges", edges, darker(TABLE)))

    def update(self, moment: Moment, past: Past) -> list[Update]:
        """They stay."""
        return [Update(np.eye(4))] * len(self.items)
