"""Every operation of the HTTP interface has a method of both clients and a command."""

from __future__ import annotations

import asyncio
import inspect
import json
import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import pytest

from sprag_study.service import client as clients
from sprag_study.service.client import AsyncClient, AsyncStudy, Client, ServiceError, Study
from tests.service.client import generate
from tests.service.conftest import Service

ID, BUSY, SCHEDULE = "st_0123456789abcdef", "st_fedcba9876543210", "sc_0123456789abcdef"
STUDY = {
    "id": ID, "name": "", "model": "vibration-drive", "cases": 1, "state": "finished", "time_over": False,
    "finish_by": None,
    "progress": {"done": 1, "total": 1, "ok": 1, "rate": None, "seconds_left": None, "in_time": None},
}  # fmt: skip
USER = {
    "role": "viewer", "created_at": "2026-11-28T06:00:00Z", "removed_at": None, "most_cases": None, "most_bytes": None,
    "most_checks": None, "quota": {"cases": 0, "bytes": 0},
}  # fmt: skip
LOAD, SPEED = "shaft.load", "shaft.speed.mean"

Call = Callable[[Any, Any], Any]
#: Of each operation: what both clients do for it (client, study), and the command.
OPERATIONS: dict[str, tuple[Call, str]] = {
    "create_study": (lambda c, _: c.submit({}), "submit SPEC"),
    "list_studies": (lambda c, _: c.studies("queued"), "list"),
    "preview_study": (lambda c, _: c.preview({}), "check SPEC --server http://sprag"),
    "get_study": (lambda _, s: s.detail(), "show ID"),
    "change_study": (lambda _, s: s.change(name="x"), "study edit ID --name x"),
    "delete_study": (lambda _, s: s.delete(), "study delete ID --yes"),
    "restore_study": (lambda _, s: s.restore(), "study restore ID"),
    "get_rounds": (lambda _, s: s.rounds(), "show ID rounds"),
    "cancel_study": (lambda _, s: s.cancel(), "study cancel ID"),
    "pause_study": (lambda _, s: s.pause(), "study pause ID"),
    "resume_study": (lambda _, s: s.resume(), "study resume ID"),
    "retry_study": (lambda _, s: s.retry(["chatter"]), "study retry ID"),
    "extend_study": (lambda _, s: s.extend([]), "study extend ID --axis shaft.load=1"),
    "run_longer": (lambda _, s: s.run_longer(), "study longer ID"),
    "narrow_study": (lambda _, s: s.narrow(), "study narrow ID"),
    "select_cases": (lambda _, s: s.select("c > 0"), "study select ID"),
    "prioritize_study": (lambda _, s: s.prioritize(3), "study prioritize ID 3"),
    "get_events": (lambda _, s: s.events(), "study watch BUSY"),
    "get_curves": (lambda _, s: s.curves(LOAD, SPEED), "show ID curves"),
    "get_map": (lambda _, s: s.map(LOAD, "b", SPEED), "show ID map --x a --y b --z c"),
    "get_results": (lambda _, s: s.table(), "export ID"),
    "get_report": (lambda _, s: s.download("pdf"), "export ID --format pdf"),
    "get_sensitivity": (lambda _, s: s.sensitivity(SPEED), "show ID sensitivity --y c"),
    "get_ribbon": (lambda _, s: s.ribbon(), "show ID ribbon"),
    "get_yield": (lambda _, s: s.yields("c > 0"), "show ID yield c>0"),
    "get_calibration": (lambda _, s: s.calibration(), "show ID calibration"),
    "get_front": (lambda _, s: s.front(), "show ID front"),
    "get_exploration": (lambda _, s: s.explore(), "show ID explore"),
    "get_answers": (lambda _, s: s.answers(), "show ID answers"),
    "list_cases": (lambda _, s: s.cases(ending="ok"), "show ID cases"),
    "get_case": (lambda _, s: s.case(3), "show ID case --case 3"),
    "get_trajectory": (lambda _, s: s.trajectory(3, 0, "2 periods", points=50), "show ID trajectory --case 3"),
    "get_branch": (lambda _, s: s.branch(3, LOAD), "show ID branch --case 3 --along shaft.load"),
    "get_diagram": (lambda _, s: s.diagram(3, LOAD), "show ID diagram --case 3 --along shaft.load"),
    "get_section": (lambda _, s: s.section(3), "show ID section --case 3"),
    "get_engagements": (lambda _, s: s.engagements(3), "show ID engagements --case 3"),
    "get_duty": (lambda _, s: s.duty(3, exponent=5), "show ID duty --case 3"),
    "get_forces": (lambda _, s: s.forces(3), "show ID forces --case 3"),
    "get_startup": (lambda _, s: s.startup(3, ramp="1 s"), "show ID startup --case 3"),
    "get_strobes": (lambda _, s: s.strobes(3), "show ID strobes --case 3"),
    "get_speeds": (lambda _, s: s.speeds(3), "show ID speeds --case 3"),
    "get_transient": (lambda _, s: s.transient(3, "run-up"), "show ID transient --case 3 --kind run-up"),
    "get_basin": (lambda _, s: s.basin(3), "show ID basin --case 3"),
    "fit_clutch": (lambda c, _: c.fit_clutch([(0, 0)], 0.1), "fit DATA --accuracy 1 --server http://sprag"),
    "create_schedule": (lambda c, _: c.create_schedule({}, cron="@daily"), "schedule add SPEC --cron @daily"),
    "list_schedules": (lambda c, _: c.schedules(), "schedule list"),
    "get_night": (lambda c, _: c.night(12), "schedule night --hours 12"),
    "get_schedule": (lambda c, _: c.schedule(SCHEDULE), "schedule show SCHEDULE"),
    "change_schedule": (lambda c, _: c.change_schedule(SCHEDULE, enabled=False), "schedule pause SCHEDULE"),
    "delete_schedule": (lambda c, _: c.delete_schedule(SCHEDULE), "schedule delete SCHEDULE"),
    "list_components": (lambda c, _: c.components("spring"), "component list"),
    "put_components": (lambda c, _: c.put_components([]), "component put SPEC"),
    "delete_component": (lambda c, _: c.delete_component("cp_1"), "component delete ID"),
    "list_views": (lambda c, _: c.views(ID), "view list --study ID"),
    "save_view": (lambda c, _: c.save_view("compare", "x"), "view save /compare --name x"),
    "change_view": (lambda c, _: c.change_view("vw_1", name="x"), "view change ID --name x"),
    "delete_view": (lambda c, _: c.delete_view("vw_1"), "view delete ID"),
    "list_models": (lambda c, _: c.models(), "models"),
    "get_model": (lambda c, _: c.model("machine-shaft"), "models machine-shaft"),
    "list_presets": (lambda c, _: c.presets(), "presets --server http://sprag"),
    "get_preset": (lambda c, _: c.preset("feeder"), "presets feeder --server http://sprag"),
    "list_workers": (lambda c, _: c.workers(), "admin workers"),
    "get_me": (lambda c, _: c.me(), "login http://localhost --token x"),
    "list_users": (lambda c, _: c.users(), "admin user list --server http://sprag"),
    "add_user": (lambda c, _: c.add_user("eve"), "admin user add eve --server http://sprag"),
    "change_user": (lambda c, _: c.change_user("dora", removed=True), "admin user remove dora --server http://sprag"),
    "hand_over_user": (
        lambda c, _: c.hand_over_user("dora", "emil"),
        "admin user hand-over dora --to emil --server http://sprag",
    ),
    "list_tokens": (lambda c, _: c.tokens(), "admin token list --server http://sprag"),
    "create_token": (
        lambda c, _: c.create_token("laptop", user="dora", days=30),
        "admin token create --name laptop --user dora --expires 30 --server http://sprag",
    ),
    "revoke_token": (
        lambda c, _: c.revoke_token("tk_1"),
        "admin token revoke tk_1 --yes --server http://sprag",
    ),
    "get_audit": (lambda c, _: c.audit(), "admin audit --server http://sprag"),
    "livez": (lambda c, _: c.live(), "admin health"),
    "readyz": (lambda c, _: c.ready(), "admin health"),
    "metrics": (lambda c, _: c.metrics(), "admin metrics"),
}


class Recorder:
    """A service that knows studies, of which one runs, and users, refuses the rest, and remembers what it was asked."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, str]] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        """Answer the next request."""
        self.asked.append((request.method.lower(), request.url.path))
        if self.asked[-1] == ("get", f"/api/v1/studies/{ID}"):
            return httpx.Response(200, json=STUDY)
        if self.asked[-1] == ("get", f"/api/v1/studies/{BUSY}"):
            listened = any(path.endswith("/events") for _, path in self.asked)
            return httpx.Response(200, json={**STUDY, "id": BUSY, "state": "finished" if listened else "running"})
        if self.asked[-1] == ("get", "/livez"):
            return httpx.Response(200, json={"status": "ok"})
        if self.asked[-1] == ("get", "/api/v1/tokens"):
            return httpx.Response(200, json={"tokens": []})
        if self.asked[-1] == ("get", "/api/v1/users"):
            return httpx.Response(200, json={"users": [{**USER, "name": name} for name in ("dora", "emil")]})
        return httpx.Response(418, json={"title": "refused"})

    def reached(self, method: str, template: str) -> bool:
        """Whether an operation was asked for."""
        pattern = re.sub(r"\\{[a-z_]+\\}", "[^/:]+", re.escape(template))
        return any(name == method and re.fullmatch(pattern, path) for name, path in self.asked)


@pytest.fixture
def operations(service: Service) -> dict[str, tuple[str, str]]:
    """Method and address of every operation by its id."""
    paths = service.http.get("/openapi.json").json()["paths"]
    return {
        operation["operationId"]: (method, path) for path, item in paths.items() for method, operation in item.items()
    }


def test_every_operation_is_in_the_list(operations: dict[str, tuple[str, str]]) -> None:
    assert set(OPERATIONS) == set(operations)


def test_the_client_has_a_method_for_each(operations: dict[str, tuple[str, str]]) -> None:
    for name, (call, _) in OPERATIONS.items():
        recorder = Recorder()
        with Client("http://sprag", transport=httpx.MockTransport(recorder)) as client, suppress(ServiceError):
            answer = call(client, Study(client, ID))
            if isinstance(answer, Iterator):
                next(answer)
        assert recorder.reached(*operations[name]), (name, recorder.asked)


def test_so_has_the_asynchronous_one(operations: dict[str, tuple[str, str]]) -> None:
    async def ask(call: Call, recorder: Recorder) -> None:
        async with AsyncClient("http://sprag", transport=httpx.MockTransport(recorder)) as client:
            answer = call(client, AsyncStudy(client, ID))
            with suppress(ServiceError):
                await (answer if inspect.isawaitable(answer) else anext(answer))

    for name, (call, _) in OPERATIONS.items():
        recorder = Recorder()
        asyncio.run(ask(call, recorder))
        assert recorder.reached(*operations[name]), (name, recorder.asked)


def test_and_a_command(
    operations: dict[str, tuple[str, str]],
    sprag: Callable[..., Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    spec = tmp_path / "spec.json"
    spec.write_text(json.dumps({"sprag": 1}))
    data = tmp_path / "clutch.csv"
    data.write_text("0.1;20\n0.2;40\n")
    words = {"SPEC": str(spec), "DATA": str(data), "ID": ID, "BUSY": BUSY, "SCHEDULE": SCHEDULE}
    genuine = clients.Client
    for name, (_, command) in OPERATIONS.items():
        recorder = Recorder()
        monkeypatch.setattr(clients, "Client", partial(genuine, transport=httpx.MockTransport(recorder)))
        done = sprag(*(words.get(word, word) for word in command.split()))
        assert recorder.reached(*operations[name]), (name, recorder.asked, done.err)


def test_the_synchronous_client_is_made_from_the_asynchronous_one(tmp_path: Path) -> None:
    folder = tmp_path / "service" / "client" / "synchronous"
    folder.mkdir(parents=True)
    views, machines = tmp_path / "views.py", tmp_path / "machines"
    generate.write(folder, views, machines)
    for path in machines.glob("*.py"):
        assert path.read_text() == (generate.MACHINES / path.name).read_text(), "run the module `generate`"
    assert views.read_text() == generate.VIEWS.read_text(), "run python -m tests.service.client.generate"
    made = {path.name: path.read_text() for path in folder.glob("*.py")}
    kept = {path.name: path.read_text() for path in generate.TARGET.glob("[a-z]*.py")}
    assert made == kept, "run python -m tests.service.client.generate"
