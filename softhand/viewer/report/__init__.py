"""One file with film, curves and numbers; films."""
