"""Coefficients of fingertip laws from measurements: reading, fitting, comparing."""
