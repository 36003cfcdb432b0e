"""Damping of the tips' material, for any fingertip law."""
