"""Ctrl-C goes to all processes of a terminal: those that are started leave it to who does so."""

import signal
import subprocess
import sys

from mplearn.spawning import deaf_to_interrupts

PROGRAM = """
import signal
from multiprocessing import get_context
from mplearn.spawning import deaf_to_interrupts
codes = []
for deaf in (True, True, False):
    process = get_context("spawn").Process(target=signal.raise_signal, args=(signal.SIGINT,))
    if deaf:
        with deaf_to_interrupts():
            process.start()
    else:
        process.start()
    process.join()
    codes.append(process.exitcode)
try:
    signal.raise_signal(signal.SIGINT)
except KeyboardInterrupt:
    print("heard", *codes)
"""


def test_a_process_never_hears_ctrl_c_and_who_started_it_does_again():
    """The first one, too: with it multiprocessing starts one that watches over resources."""
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True)
    assert done.stdout == "heard 0 0 1\n" and done.stderr.count("Traceback") == 1


def test_an_interrupt_that_comes_meanwhile_is_heard_at_the_end():
    heard = []
    before = signal.signal(signal.SIGINT, lambda number, frame: heard.append(number))
    try:
        with deaf_to_interrupts():
            signal.raise_signal(signal.SIGINT)
            assert not heard
        assert heard == [signal.SIGINT]
    finally:
        signal.signal(signal.SIGINT, before)
