"""A scenario or a recording explained and doubted."""
