"""The heat descriptor of the thesis, and its score."""
