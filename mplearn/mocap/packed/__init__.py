"""Files that are packed: one by one, or many in an archive."""
