"""The segments that a tree remembers: as they are compared, with their models and distances."""
