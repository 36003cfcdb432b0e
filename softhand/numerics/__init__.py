"""Compiling, linear algebra, roots, rotations: what knows nothing of hands."""
