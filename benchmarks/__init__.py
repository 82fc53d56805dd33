"""Timings, as ratios against named peers or floors, interleaved in one run: ``make bench``."""
