"""The state at rest that a run begins with."""
