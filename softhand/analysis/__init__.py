"""Numbers and tables from a model or a recording."""
