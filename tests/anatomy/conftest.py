"""A person who moves, and what is true of it."""

import numpy as np
import pytest
from known_person import RATE_HZ, SCRIPT, Truth

from mplearn.body import human_body
from mplearn.demonstrator import Person, demonstrate


@pytest.fixture(scope="session")
def truth() -> Truth:
    person = Person.random(np.random.default_rng(3))
    shown = demonstrate(SCRIPT, seed=1, person=person, rate_hz=RATE_HZ)
    body = human_body(person.height_m, person.proportions)
    return Truth(body, shown.posture.frames, shown.recording)
