"""Formats of markers and tables: where points are, by name."""
