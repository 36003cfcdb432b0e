"""Soft contact of a tip with a face: geometry, kinematics, force."""
