"""A run as named arrays with units, on disk and off."""
