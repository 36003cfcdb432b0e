"""The parts of a scene: each makes its items, and moves them to a moment."""
