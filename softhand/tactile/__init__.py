"""Taxels: what a skin of many small sensors feels on each soft tip, and what a camera behind it sees."""
