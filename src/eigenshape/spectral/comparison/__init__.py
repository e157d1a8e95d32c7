"""Two spectra side by side."""
