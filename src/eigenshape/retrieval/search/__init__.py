"""Search in stages: a coarse scan of short rows, exact scores of the best, verification."""
