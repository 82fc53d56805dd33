"""The ``mplearn`` program, also ``python -m mplearn_agents``."""

import _signal  # type: ignore[import-not-found]  # signal loads others, and Ctrl-C could come


def main() -> int:
    """Run the command, see `mplearn_agents.cli`; Ctrl-C while that is loaded just ends it."""
    _signal.signal(_signal.SIGINT, _signal.SIG_DFL)
    from mplearn_agents.cli import main as run

    return run()


if __name__ == "__main__":
    raise SystemExit(main())
