"""Pairs of contacts that an internal force acts between."""

from __future__ import annotations

from itertools import combinations


def contact_pairs(n_contacts: int) -> list[tuple[int, int]]:
    """Pairs of contacts that an internal force acts between, in the paper's order: (2, 3), (1, 3), (1, 2), from 0."""
    return list(combinations(range(n_contacts), 2))[::-1]
