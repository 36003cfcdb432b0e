"""One run as checked data, and the files that it is in."""
