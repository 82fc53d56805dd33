"""Where a recording stands: its unit of length and its vertical axis, found from the person."""
