"""Shapes of motions, by which leaves of several people are compared."""
