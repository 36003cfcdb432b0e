"""Convex shapes of objects, one a file."""
