"""Descriptors of patches: one codebook entry a patch, and geometric verification."""
