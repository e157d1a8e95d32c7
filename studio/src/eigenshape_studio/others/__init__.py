"""Other shapes: a second one with a map, the specimens of a collection, the matches of an index."""
