"""What a room does by another above it."""

import subprocess
import sys

import pytest

from mplearn.errors import InvalidValueError
from mplearn.offers import ask


def test_a_task_that_nobody_does_is_named_with_those_that_are_done():
    with pytest.raises(InvalidValueError, match=r"nobody does 'fly'.*read a library from a store"):
        ask("fly")


def test_who_does_it_is_loaded_only_then():
    code = (
        "import sys, mplearn.library\n"
        "from mplearn.offers import ask\n"
        "assert not {'mplearn.store', 'mplearn.tables', 'mplearn.learner'} & sys.modules.keys()\n"
        "assert ask('read a library from a store') is sys.modules['mplearn.store'].library_of\n"
        "assert 'mplearn.tables' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
