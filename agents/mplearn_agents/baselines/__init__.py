"""Baselines in single files, to be read from top to bottom, copied and changed."""
