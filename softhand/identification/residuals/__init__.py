"""What residuals show, how large the errors are, and the intervals that follow."""
