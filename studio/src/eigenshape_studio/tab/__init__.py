"""One tab: what the hand did there, its session on disk, and the calls of its page."""
