"""Collisions that a run passes over: links with the object, the table, palms and other links, from collision shapes."""
