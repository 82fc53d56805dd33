import pytest

from mplearn.demonstrator import demonstrate
from mplearn.recording import Recording


@pytest.fixture(scope="session")
def session() -> Recording:
    """A person who performs a few motions, several times."""
    return demonstrate(["BAR", "BAL", "RAR", "RAL"] * 3, seed=3).recording
