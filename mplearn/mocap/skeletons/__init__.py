"""Formats of skeletons: joints, their hierarchy, and how they turn."""
