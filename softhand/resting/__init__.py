"""Where hand and object come to rest: forces in balance, followed quasi-statically from a state."""
