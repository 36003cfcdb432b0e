"""A run of a real hand, or a recorded one, computed anew: what numbers of its scenario it tells."""
