"""A law as a function of its coefficients, and the coefficients of the smallest sum of squares."""
