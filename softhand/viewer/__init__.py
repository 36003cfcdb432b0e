"""Seeing a run: the scene as plain geometry, and a live page that shows it."""
