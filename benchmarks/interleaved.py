"""Times several functions in turn, so that a machine that changes its speed changes it for all."""

import time
from collections.abc import Callable, Mapping

import numpy as np


def interleaved(
    functions: Mapping[str, Callable[[], object]], *, rounds: int = 7
) -> dict[str, float]:
    """Return the median processor time of each [s], after one call that is not counted."""
    for function in functions.values():
        function()
    times: dict[str, list[float]] = {name: [] for name in functions}
    for _ in range(rounds):
        for name, function in functions.items():
            begin = time.process_time()
            function()
            times[name].append(time.process_time() - begin)
    return {name: float(np.median(each)) for name, each in times.items()}
