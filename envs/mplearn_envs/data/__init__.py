"""The built-in library, and the command that makes it."""
