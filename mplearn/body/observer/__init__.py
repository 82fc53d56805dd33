"""From a stream of markers to the learner's features: who is there, in which axes."""
