"""Descriptors, their scores, and the index that finds similar shapes."""
