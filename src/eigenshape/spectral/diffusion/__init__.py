"""The heat operator, its kernel and its trace, with and without a spectrum."""
