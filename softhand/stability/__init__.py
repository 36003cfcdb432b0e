"""The closed loop about a state: linear, and by the paper's proof."""
