"""From a material to a fingertip: hardness, finite elements of a bonded hemisphere, tables for laws."""
