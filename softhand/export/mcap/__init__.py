"""MCAP logs with the schemas of Foxglove, which Foxglove, Lichtblick and others open."""
