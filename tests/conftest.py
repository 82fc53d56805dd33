import pytest
from hypothesis import settings

from mplearn_envs.rendering.backend import choose_backend

settings.register_profile("untimed", deadline=None)  # no time is right on every machine
settings.load_profile("untimed")

CAN_DRAW = choose_backend()  # before anything imports mujoco, which reads MUJOCO_GL then


@pytest.fixture(scope="session")
def renderer() -> None:
    """Skip where no picture can be drawn off screen."""
    if not CAN_DRAW:
        pytest.skip("no off-screen renderer on this machine; see scripts/system_packages.sh")
