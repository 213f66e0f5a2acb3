"""Expressions written out: a printer a file, all from the same layout of signs, fractions, powers and sums."""
