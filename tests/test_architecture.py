"""The map of the code shows every room, and nothing that is not there."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from sprag_study.worker import models

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
PACKAGES = sorted(
    str(path.parent.relative_to(ROOT))
    for package in ("service", "worker", "engine")
    for path in (ROOT / package).rglob("__init__.py")
)
ADDING = (ROOT / "docs" / "adding.md").read_text(encoding="utf-8")
#: What both pages name, but for files that are yet to be written.
NAMED = sorted(
    name
    for name in set(
        re.findall(r"`((?:service|worker|engine|migrations|tests|benchmarks|docs)/[\w./]*)`", PAGE + ADDING)
    )
    if "NAME" not in name
)


@pytest.mark.parametrize("package", [package for package in PACKAGES if "/" in package])
def test_every_room_is_on_the_map(package: str) -> None:
    assert f"`{package}/`" in PAGE


@pytest.mark.parametrize("name", NAMED)
def test_what_the_map_names_is_there(name: str) -> None:
    assert (ROOT / name).exists()


def test_what_lies_loose_in_the_service_is_the_ground() -> None:
    loose = {path.stem for path in (ROOT / "service").glob("*.py")} - {"__init__"}
    ground = re.search(r"ground that all of them stand on: ([^.]*)\.", PAGE)
    assert ground is not None
    assert set(re.findall(r"`(\w+)`", ground[1])) == loose


def test_the_contracts_keep_every_model_apart() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    apart = {module for contract in contracts if contract["type"] == "independence" for module in contract["modules"]}
    for name in models.model_names():
        package = type(models.model_of(name)).__module__.removesuffix(".model")
        assert {f"sprag_study.engine.{name.replace('-', '_')}", package} <= apart
