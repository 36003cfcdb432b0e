"""Sweeps: the runs of a study, in a store that grows a chunk at a time and loses none."""
