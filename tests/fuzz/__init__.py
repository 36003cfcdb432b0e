"""Inputs of strangers by the thousand: seeded mutations of files that ship, and what must not come of them."""
