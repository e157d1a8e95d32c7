"""Synthetic shapes: surfaces, domains, creatures in poses, and their exact spectra."""
