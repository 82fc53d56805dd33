"""The nodes of a tree: groups of alike segments, how they are found, and what keeps them whole."""
