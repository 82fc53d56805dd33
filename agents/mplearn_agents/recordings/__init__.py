"""Recordings on the command line: how they are read, and what is in them."""
