"""CSV files from anywhere: lines, cells, columns, units."""
