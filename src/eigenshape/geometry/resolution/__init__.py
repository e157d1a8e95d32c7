"""The same shape by fewer simplices, or by more."""
