"""The plant and its controller about a state: as a linear system, and by the paper's proof."""
