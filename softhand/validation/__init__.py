"""Small systems with known answers: what softhand measures of them beside what is exact."""
