"""What the commands return to who runs them, besides 0: done."""

NOT_IN_ORDER = 1  # something that was checked
BAD_INPUT = 2  # argparse says so of a bad option, too
SIGNALLED = 128  # and the number of the signal
INTERRUPTED = 130  # by a person; what it can keep, it has kept, and said so
