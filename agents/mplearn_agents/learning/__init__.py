"""Learning from the command line while one looks on: recordings, a live source, whole corpora."""
