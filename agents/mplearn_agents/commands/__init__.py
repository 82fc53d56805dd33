"""The sub-commands of ``mplearn``.

Each module is one: it has ``HELP`` (a sentence), ``EXAMPLE`` (a command line),
``add_arguments(parser)`` and ``run(args)``, which returns the exit code or None for 0, and raises
an `mplearn.errors.MPLearnError` where the input is bad. What takes long to import is imported
inside ``run``.
"""
