"""Triangles and segments, as plain numpy."""
