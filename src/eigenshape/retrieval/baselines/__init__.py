"""Peers of the literature: ShapeDNA, affinity spectra, light fields."""
