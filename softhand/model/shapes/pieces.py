"""The parts of a mesh file, each with its place, as one set of triangles of bounded size."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import Array

Triangles = NDArray[np.int64]

MOST_TRIANGLES = 200_000
"""Of a file. The faces that are left of them are far fewer, and a hull of more would take a gigabyte."""


_MOST_PIECES = 4_000


def check_count(count: int, most: int, of: str = "triangles") -> None:
    """ValueError for too many of them."""
    if count > most:
        raise ValueError(f"it has {count} {of}, at most {most} are read")


class Pieces:
    """Vertices and triangles that are put together piece by piece.

    Args:
        most: triangles that they may have.
    """

    def __init__(self, most: int) -> None:
        self.most = most
        self._vertices: list[Array] = []
        self._triangles: list[Triangles] = []
        self._count = self._points = 0

    def add(self, vertices: Array, triangles: Triangles, place: Array) -> None:
        """One piece more.

        Args:
            vertices: shape (n, 3).
            triangles: places in them, shape (m, 3).
            place: of the piece, a homogeneous matrix, shape (4, 4); one that mirrors turns the triangles over.

        Raises:
            ValueError: a triangle has a vertex that is not there, or there are too many triangles.
        """
        self._count += len(triangles)
        check_count(self._count, self.most)
        check_count(len(self._triangles), _MOST_PIECES, "pieces")
        if not len(triangles):
            return
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            raise ValueError("a triangle has a vertex that is not there")
        used, index = np.unique(triangles, return_inverse=True)  # pieces may share one list of vertices
        triangles = index.reshape(-1, 3)
        turns = np.linalg.det(place[:3, :3]) < 0.0
        self._vertices.append(vertices[used] @ place[:3, :3].T + place[:3, 3])
        self._triangles.append((triangles[:, ::-1] if turns else triangles) + self._points)
        self._points += len(used)

    def all(self) -> tuple[Array, Triangles]:
        """All vertices, shape (n, 3), and all triangles, shape (m, 3)."""
        if not self._triangles:
            return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
        return np.concatenate(self._vertices), np.concatenate(self._triangles)


def fans(sizes: NDArray[np.int64], most: int) -> Triangles:
    """Polygons, whose corners stand one behind the other, as triangles about the first corner of each.

    Args:
        sizes: corners of each; of fewer than three there is no triangle.
        most: triangles that they may be.

    Raises:
        ValueError: there are too many.
    """
    counts = np.maximum(sizes - 2, 0)
    total = int(counts.sum())
    check_count(total, most)
    first = np.repeat(np.cumsum(sizes) - sizes, counts)
    k = np.arange(total) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.column_stack([first, first + k + 1, first + k + 2])


def strips(sizes: list[int], most: int) -> Triangles:
    """Strips of triangles, whose corners stand one behind the other; every second triangle is turned."""
    check_count(sum(max(size - 2, 0) for size in sizes), most)
    rows, start = [np.zeros((0, 3), dtype=np.int64)], 0
    for size in sizes:
        k = np.arange(max(size - 2, 0))
        rows.append(start + np.column_stack([k + k % 2, k + 1 - k % 2, k + 2]))
        start += size
    return np.concatenate(rows)
