"""What the commands return to who runs them, besides 0: done."""

NOT_IN_ORDER = 1  # something that was checked
BAD_INPUT = 2  # argparse says so of a bad option, too
SIGNALLED = 128  # and the number of the signal
NOT_KEPT = 3  # what was learned is not all where it was to be: the disk is full
INTERRUPTED = 130  # by a person; what it can keep, it has kept, and said so
