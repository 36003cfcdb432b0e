"""Fingertip laws: deformation in, force out."""
