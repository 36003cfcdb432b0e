"""Time integration: a state carried over one step."""
