"""Feature points and parts that persist."""
