"""What the library gives goes through pickle, copy and processes; secrets do not, and what cannot says why."""

from __future__ import annotations

import base64
import copy
import json
import multiprocessing
import os
import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import pytest
import sqlalchemy as sa
import typer

import sprag_study as sprag
from sprag_study.service import login
from sprag_study.service.actor import Role
from sprag_study.service.client import AmbiguousError, AsyncClient, AsyncStudy, Client, Study, UntrustedError
from sprag_study.service.client.errors import ArgumentError
from sprag_study.service.client.wire import COMPUTED, TIMEOUT
from sprag_study.service.faults import Fault
from sprag_study.service.jobs.local import StudyHeldError
from sprag_study.service.spec.saved_views import View
from sprag_study.service.storage.errors import StudyNotFoundError
from sprag_study.service.storage.people.scopes import TokenScope
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.tables import STUDIES, all_tables
from tests.service.timed_spec import SPEC

LOAD, SPEED = "shaft.load", "shaft.speed.mean"
SMALL: dict[str, Any] = {**SPEC, "axes": [{"path": LOAD, "values": ["0 N*m", "0.1 N*m"]}]}


@pytest.fixture(scope="module")
def run() -> sprag.Study:
    """A small study, run here."""
    return sprag.run(SMALL, processes=0)


def again(thing: Any) -> Any:
    """The same after a pickle."""
    return pickle.loads(pickle.dumps(thing))


def test_answers_are_the_same_after_a_pickle(run: sprag.Study) -> None:
    motion = run.trajectory(1, points=20)
    for answer in (
        run.curves(LOAD, SPEED),
        motion,
        run.engagements(1),
        run.plot(LOAD, SPEED),
        sprag.compare([run, run], LOAD, SPEED),
        run.strobes(1),
        run.answers(),
    ):
        assert again(answer) == copy.copy(answer) == copy.deepcopy(answer) == answer
    assert again(motion).to_pandas().attrs == motion.to_pandas().attrs


def test_drafts_are_the_same_after_a_pickle() -> None:
    drive = sprag.Drive.of("one_pendulum").vary(load=[0.0, 0.1])
    for draft in (drive, sprag.Shaft.of("press"), drive.goal(vary={"mass": (0.1, 0.5)}, best={"efficiency": "max"})):
        assert type(again(draft)) is type(copy.deepcopy(draft)) is type(draft)
        assert dict(again(draft)) == dict(copy.copy(draft)) == dict(draft)
    assert again(drive).hold(load=0.1)["base"]["shaft"]["load"] == 0.1


@pytest.mark.parametrize("kind", [Client, AsyncClient])
def test_a_client_leaves_its_token_behind(kind: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SPRAG_TOKEN", raising=False)
    client = kind("http://sprag.example/office/", "very-secret", retry=3.0, timeout=300.0)
    content = pickle.dumps(client)
    assert b"very-secret" not in content
    opened = pickle.loads(content)
    assert (type(opened), opened.server, opened.retry) == (kind, "http://sprag.example/office", 3.0)
    assert "authorization" not in opened._http.headers
    monkeypatch.setenv("SPRAG_TOKEN", "of-this-machine")
    assert pickle.loads(content)._http.headers["authorization"] == "Bearer of-this-machine"
    assert "authorization" not in again(kind("http://sprag.example", ""))._http.headers
    assert copy.copy(client) is copy.deepcopy(client) is client


@pytest.mark.parametrize(("client", "kind"), [(Client, Study), (AsyncClient, AsyncStudy)])
def test_a_study_of_a_service_keeps_its_address_and_its_summary(client: Any, kind: Any) -> None:
    study = kind(client("http://sprag.example", "very-secret"), "st_1", {"id": "st_1", "name": "one", "cases": 3})
    opened = again(study)
    assert (repr(opened), opened.summary, opened._client.server) == (repr(study), study.summary, study._client.server)
    assert copy.copy(study)._client is copy.deepcopy(study)._client is study._client


def test_what_cannot_be_pickled_says_why() -> None:
    client = Client("http://sprag.example", transport=httpx.MockTransport(lambda _: httpx.Response(500)))
    with pytest.raises(TypeError, match="a client with a transport of its own cannot be pickled"):
        pickle.dumps(Study(client, "st_1"))


FAULT = Fault("/base", "required", "is required")


@pytest.mark.parametrize(
    "error",
    [
        sprag.SpecError([FAULT]),
        sprag.RefusedError(422, {"type": "/problems/invalid-spec", "errors": [FAULT.to_json()]}),
        sprag.SpecFileError("no file"),
        sprag.StatementError("no statement"),
        sprag.StudyTimeoutError({"id": "st_1", "state": "running"}, 3.0),
        sprag.UnreachableError("http://sprag.example", "cannot connect"),
        UntrustedError("http://sprag.example", "it is old"),
        AmbiguousError("st", ["st_1", "st_2"]),
        ArgumentError("case", -1, "whole numbers"),
        sprag.MissingExtraError("needs pandas", name="pandas"),
        sprag.StoreError("closed", "closed"),
        sprag.ExecutorError("no processes"),
        StudyHeldError("held"),
        StudyNotFoundError("st_1"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_errors_come_back_from_other_processes(error: Any) -> None:
    """One that cannot be opened would end the pool of the script instead of naming the fault."""
    opened = again(error)
    assert (type(opened), str(opened), opened.code) == (type(error), str(error), error.code)
    assert (opened.args, opened.faults, vars(opened)) == (error.args, error.faults, vars(error))


def fastest(study: sprag.Study) -> tuple[float, int]:
    """The largest speed of a study, in the process that computes it."""
    return float(study.table()[SPEED].max()), os.getpid()


def test_a_study_goes_to_another_process_with_its_rows(run: sprag.Study) -> None:
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        speed, process = pool.submit(fastest, run).result()
    assert (speed, process != os.getpid()) == (fastest(run)[0], True)


def test_a_pickle_has_one_study_and_nobody(tmp_path: Path) -> None:
    """Whoever gets the pickle of one study gets no other one of its database, and no key of its service."""
    database = str(tmp_path / "office.sqlite3")
    other = sprag.run({**SMALL, "name": "of the competitor"}, database=database, processes=0)
    study = sprag.run({**SMALL, "axes": [{"path": LOAD, "values": ["0.1 N*m", "0.2 N*m"]}]}, database=database)
    with Store.open(f"sqlite:///{database}") as store:
        secret = store.people.create_session_key()
        store.people.add_user("anna", Role.DESIGNER)
        token, _ = store.people.create_token("laptop", TokenScope.WRITE, owner="anna")
        store.views.save(View("curves", "the best", study=study.id, in_report=True))
        with store.session.write() as connection:
            connection.execute(sa.update(STUDIES).values(owner="anna"))
    content, report = pickle.dumps(study), study.download("html")
    for hidden in (b"anna", b"competitor", other.id.encode(), token.encode(), secret.hex().encode()):
        assert hidden not in content
    for opened in (again(study), copy.copy(study), copy.deepcopy(study)):
        with opened:
            store = opened._client.library.store
            with store.session.read() as reading:
                full = {
                    table.name
                    for table in all_tables().sorted_tables
                    if reading.execute(sa.select(sa.literal(1)).select_from(table).limit(1)).first()
                }
            assert full - {"deployment"} == {
                "studies", "chunks", "endings", "stages", "fingerprints", "saved_views", "vibration_drive_1",
            }  # fmt: skip
            assert opened.table().equals(study.table())
            assert opened.detail() == {**study.detail(), "owner": None}
            assert opened.download("html") == report
            assert store.check().problems == ()
            further = opened.extend([{"path": LOAD, "values": ["0.1 N*m", "0.3 N*m"]}]).detail()
            assert (further["progress"]["ok"], further["reused"]) == (3, 2)


def test_a_closed_study_says_so() -> None:
    study = sprag.run(SMALL, processes=0)
    study.close()
    for ask in (pickle.dumps, copy.copy, copy.deepcopy, sprag.Study.detail, lambda closed: closed.sql("from cases")):
        with pytest.raises(sprag.StoreError, match="the study is closed"):
            ask(study)


def test_the_folder_of_a_pickle_is_swept_after_a_kill(run: sprag.Study, tmp_path: Path) -> None:
    content = tmp_path / "study.pickle"
    content.write_bytes(pickle.dumps(run))
    folder = tmp_path / "temporary"
    folder.mkdir()
    program = (
        f"import pickle; study = pickle.load(open({str(content)!r}, 'rb')); print(study.id, flush=True);"
        "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
    )
    environment = {"TMPDIR": str(folder), "PATH": "/usr/bin:/bin"}
    run_killed = [sys.executable, "-c", program]
    killed = subprocess.run(run_killed, env=environment, capture_output=True, text=True, check=False)
    assert killed.stdout.strip() == run.id, killed.stderr
    left = list(folder.iterdir())
    assert left
    for path in left:
        os.utime(path, (time.time() - 3600.0, time.time() - 3600.0))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tempfile, "tempdir", str(folder))
        opened = pickle.loads(content.read_bytes())
        assert len(opened.table()) == 2
        assert not set(left) & set(folder.iterdir())
        opened.close()
    assert not list(folder.iterdir())


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[dict[str, str]], None]:
    """Writes the file of a login."""
    for name in ("SPRAG_SERVER", "SPRAG_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(typer, "get_app_dir", lambda name: str(tmp_path / name))

    def write(profile: dict[str, str]) -> None:
        login.profile_file().parent.mkdir(exist_ok=True)
        login.profile_file().write_text(json.dumps(profile))

    return write


def test_a_client_asks_the_service_of_the_login(
    kept: Callable[[dict[str, str]], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert Client().server == login.DEFAULT_SERVER
    kept({"server": "http://office.example", "token": "of-the-login"})
    for client in (Client(), again(Client()), Client("http://office.example/")):
        assert client.server == "http://office.example"
        assert client._http.headers["authorization"] == "Bearer of-the-login"
    assert "authorization" not in Client("http://elsewhere.example")._http.headers
    assert "authorization" not in Client(token="")._http.headers
    monkeypatch.setenv("SPRAG_SERVER", "http://near.example")
    assert (Client().server, Client()._http.headers.get("authorization")) == ("http://near.example", None)


def test_the_token_of_the_environment_does_not_go_to_the_service_of_the_login(
    kept: Callable[[dict[str, str]], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    kept({"server": "https://office.example", "token": "of-the-login"})
    monkeypatch.setenv("SPRAG_TOKEN", "of-this-machine")
    addresses = ("https://office.example/", "https://OFFICE.example:443")
    for client in (Client(), again(Client()), *map(Client, addresses), *map(AsyncClient, addresses)):
        assert client._http.headers["authorization"] == "Bearer of-the-login"
    assert Client("http://office.example")._http.headers["authorization"] == "Bearer of-this-machine"
    kept({"server": "https://office.example"})
    assert again(Client())._http.headers["authorization"] == "Bearer of-this-machine", "the login has no token"
    monkeypatch.setenv("SPRAG_SERVER", "https://office.example")
    assert again(Client())._http.headers["authorization"] == "Bearer of-this-machine"


@pytest.mark.parametrize("kind", [Client, AsyncClient])
def test_a_password_in_the_address_is_left_behind(kind: Any) -> None:
    client = kind("https://anna:very-secret@sprag.example:8443/office/")
    assert client.server == "https://sprag.example:8443/office"
    assert repr(client) == f"{kind.__name__}('https://sprag.example:8443/office')"
    assert client._http.base_url == f"{client.server}/"
    content = pickle.dumps(client)
    assert b"very-secret" not in content
    assert b"anna" not in content
    assert pickle.loads(content).server == client.server
    for wrong in (
        "ftp://anna:very-secret@sprag.example",
        "anna:very-secret@sprag.example",
        "http://anna:very/secret@a",
    ):
        with pytest.raises(ValueError, match="is not") as refused:
            kind(wrong)
        assert "very" not in str(refused.value)
        assert "secret" not in str(refused.value)
    sent: list[httpx.Headers] = []
    transport = httpx.MockTransport(lambda request: sent.append(request.headers) or httpx.Response(200, json={}))
    Client("http://anna:very%20secret@sprag.example", "", transport=transport).me()
    assert sent[0]["authorization"] == f"Basic {base64.b64encode(b'anna:very secret').decode()}"
    bare = kind("http://sprag.example/a@b")
    assert bare.server == "http://sprag.example/a@b"


def test_answers_that_are_computed_are_waited_for_longer() -> None:
    waited: dict[str, float] = {}

    def answer(request: httpx.Request) -> httpx.Response:
        waited[f"{request.method} {request.url.path.removeprefix('/api/v1')}"] = request.extensions["timeout"]["read"]
        return httpx.Response(418, json={"title": "refused"})

    def asked(client: Client) -> None:
        study = Study(client, "st_1")
        asking: list[Callable[[], Any]] = [
            study.detail, study.calibration, lambda: study.branch(3, LOAD), lambda: client.preview({}), client.me,
        ]  # fmt: skip
        for ask in asking:
            with pytest.raises(sprag.RefusedError):
                ask()

    asked(Client("http://sprag.example", transport=httpx.MockTransport(answer)))
    assert waited == {
        "GET /studies/st_1": TIMEOUT.read,
        "GET /me": TIMEOUT.read,
        "GET /studies/st_1/calibration": COMPUTED.read,
        "GET /studies/st_1/cases/3/branch": COMPUTED.read,
        "POST /studies:preview": COMPUTED.read,
    }
    asked(Client("http://sprag.example", timeout=3000.0, transport=httpx.MockTransport(answer)))
    assert set(waited.values()) == {3000.0}
