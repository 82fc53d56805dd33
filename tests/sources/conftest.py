import pytest
from servers import learned_from

from mplearn.demonstrator import demonstrate
from mplearn.recording import Recording


@pytest.fixture(scope="session")
def session() -> Recording:
    """A person who performs a few motions, several times."""
    return demonstrate(["BAR", "BAL", "RAR", "RAL"] * 2, seed=3).recording


@pytest.fixture(scope="session")
def learned_session(session: Recording, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The learner of the session, as bytes."""
    path = tmp_path_factory.mktemp("session") / "learner"
    return learned_from(session.frames, session.channels, session.rate_hz, path)
