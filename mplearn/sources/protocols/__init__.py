"""The protocols of live motion: one a file."""
