"""The sub-commands of ``mplearn``.

Each module is one: it has ``HELP`` (a sentence), ``add_arguments(parser)`` and ``run(args)``, and
raises an `mplearn.errors.MPLearnError` where the input is bad. What takes long to import is
imported inside ``run``.
"""
