"""What one robot makes of a library: motions, verdicts, plans, and what may follow what."""
