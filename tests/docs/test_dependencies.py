"""What pyproject.toml declares, the product imports."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PRODUCT = "\n".join(
    path.read_text(encoding="utf-8")
    for package in ("mplearn", "envs/mplearn_envs", "agents/mplearn_agents")
    for path in (ROOT / package).rglob("*.py")
)
USERS = {  # extras of users; the others are for who develops mplearn
    extra: PROJECT["optional-dependencies"][extra]
    for extra in ("report", "rl", "offline", "cluster", "robots")
}


@pytest.mark.parametrize(
    "requirement", sorted({*PROJECT["dependencies"], *(r for some in USERS.values() for r in some)})
)
def test_a_declared_package_is_imported(requirement: str) -> None:
    module = re.split(r"[\[<>=~! ]", requirement)[0].replace("-", "_")
    by_name = rf'(import|from) {module}\b|"{module}"'
    assert re.search(by_name, PRODUCT), f"no file imports {module}"
