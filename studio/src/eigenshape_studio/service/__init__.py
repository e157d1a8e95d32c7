"""A search service on an index: a page to drop a scan on, and calls for programs."""
