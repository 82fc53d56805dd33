"""Hidden semi-Markov models: left-right chains with explicit state durations."""
