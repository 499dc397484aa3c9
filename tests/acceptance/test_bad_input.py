"""Wrong input to a real service, over HTTP and through the commands: refused by name, never a fault of the service."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import pytest

from tests.acceptance.processes import EXAMPLES, SECONDS, Service
from tests.conftest import Finished
from tests.wrong_specs import BASE, WRONG, changed

JSON = {"Content-Type": "application/json"}


@pytest.fixture(scope="module")
def http(running: Service) -> Iterator[httpx.Client]:
    """One client of the service: to make one takes longer than a request."""
    with httpx.Client(base_url=f"{running.address}/api/v1", timeout=SECONDS) as client:
        yield client


@pytest.mark.parametrize("address", ["studies", "studies:preview"])
@pytest.mark.parametrize("name", WRONG)
def test_wrong_specs_are_problem_documents(http: httpx.Client, name: str, address: str) -> None:
    text, named = WRONG[name]
    answer = http.post(f"/{address}", content=text, headers=JSON)
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert problem["type"] == "/problems/invalid-spec"
    assert named in json.dumps(problem["errors"])


@pytest.mark.parametrize("name", [name for name, (text, _) in WRONG.items() if text.startswith("{")])
def test_wrong_specs_through_submit(
    running: Service, tmp_path: Path, name: str, sprag: Callable[..., Finished]
) -> None:
    text, named = WRONG[name]
    path = tmp_path / "spec.json"
    path.write_text(text)
    done = sprag("submit", path, "--server", running.address)
    assert done.code == 2
    assert done.out == ""
    assert named in done.err


def test_a_weak_spring_is_allowed_but_said(http: httpx.Client) -> None:
    text = changed("/base/pendulums/0/spring_rate", "1 N/m")
    answer = http.post("/studies", content=text, headers=JSON)
    assert answer.status_code == 202
    assert answer.json()["warnings"]


def test_the_base_of_these_specs_is_itself_right(http: httpx.Client) -> None:
    answer = http.post("/studies:preview", json=BASE)
    assert answer.status_code == 200
    assert answer.json()["cases"] == 2


def test_wrong_questions_through_the_commands(running: Service, tmp_path: Path, sprag: Callable[..., Finished]) -> None:
    at = ("--server", running.address)
    study = sprag("submit", EXAMPLES / "measured_clutch.json", "--wait", "--json", *at).data["id"]
    wrong = [
        (("study", "watch", "st_nothing"), "no study"),
        (("cancel", "../../etc/passwd"), ""),
        (("cancel", study), "finished"),
        (("curve", study, "--x", "shaft.lode", "--y", "torque.max"), "shaft.load"),
        (("curve", study, "--x", "shaft.load", "--y", "torque.maxx"), "torque.max"),
        (("curve", study, "--x", "shaft.load", "--y", "torque.max", "--at", "nonsense"), "at"),
        (("curve", study, "--x", "shaft.load", "--y", "torque.max", "-o", tmp_path / "x.gif"), ".svg"),
        (("export", study, "-o", tmp_path / "no" / "rows.csv"), "no such file"),
        (("export", "st_nothing"), "no study"),
        (("submit", EXAMPLES / "measured_clutch.json", "--key", "a b"), "Idempotency-Key"),
    ]
    for arguments, named in wrong:
        done = sprag(*arguments, *at)
        assert done.code == 2, (arguments, done)
        assert done.out == ""
        assert named in done.err, (arguments, done.err)
        machine = sprag(*arguments, *at, "--json")
        assert json.loads(machine.err)["exit_code"] == 2
