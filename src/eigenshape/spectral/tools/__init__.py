"""What spectra are used for: projection, embeddings, clustering, compression, watermarks."""
