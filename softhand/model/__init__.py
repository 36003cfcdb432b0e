"""Rigid bodies: URDF to Pinocchio, and their terms at one state."""
