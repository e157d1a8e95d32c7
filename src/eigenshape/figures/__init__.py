"""Pictures of shapes and spectra, drawn without a display or a GPU."""
