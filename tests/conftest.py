"""What tests of several parts share: the command line, run inside the test's own process."""

from __future__ import annotations

import gc
import json
import logging
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from _pytest.capture import CaptureIO
from hypothesis import HealthCheck, settings

from tests import postgres

# How long an example takes says something about the machine, not about the program. The gate draws the same examples
# every time; on a developer's machine new ones are tried.
settings.register_profile(
    "sprag", deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize="CI" in os.environ
)
settings.load_profile("sprag")

ROOT = Path(__file__).resolve().parents[1]

# Commands are in English, whatever the language of this machine is.
os.environ["SPRAG_LANGUAGE"] = "en"

# All modules that are imported stay: looking for garbage among them took a third of the time of collecting the tests.
gc.disable()


#: Files that take long, in the order in which they are begun: several run side by side, and none of these may be last.
#: The first one compiles the kernel of most others, which the next two do not need.
LONG = (
    "acceptance/test_readme.py",
    "service/http/test_fuzzing.py",
    "service/http/web/test_accessibility.py",
    "engine/compile/test_ways.py",
    "service/http/web/test_study_pages.py",
    "service/http/web/test_motion_pages.py",
    "acceptance/test_faults.py",
    "engine/vibration_drive/test_against_scipy.py",
    "acceptance/test_commands.py",
    "acceptance/test_kills.py",
    "service/storage/test_postgres.py",
    "worker/executors/test_dask.py",
    "worker/executors/test_lost_cluster.py",
    "worker/executors/test_rolling_upgrade.py",
    "acceptance/test_cut_link.py",
    "acceptance/test_same_rows.py",
    "acceptance/test_wheel.py",
    "acceptance/test_containers.py",
    "engine/test_odd_drives.py",
    "worker/executors/test_executors.py",
    # By their names these would be among the last.
    "worker/executors/test_dask_docs.py",
    "worker/executors/test_job_queue.py",
    "sprag_study/test_library.py",
    "service/test_presets.py",
    "service/http/web/test_study_sheet.py",
    "service/report/test_report.py",
    "service/schedules/test_two_nights.py",
)


#: Files that share a server or a browser, which each process of tests starts for itself: one process runs them.
TOGETHER = (
    *(
        tuple(f"tests/service/http/web/test_{name}.py" for name in names.split())
        for names in (
            "connection designers figures_in_browser me nights paper_and_phones rows_in_browser sheet study_pages "
            "study_rows",
            "form_in_browser keys live machine_forms motion_pages openid_in_browser order prefix_page report_walk "
            "returning script_texts site toy_in_browser walks",
        )
    ),
    tuple(
        f"tests/acceptance/test_{name}.py"
        for name in ("bad_input", "commands", "morning", "notebook", "same_rows", "traces")
    ),
)

#: The fixtures of what the files of a group share.
SHARED = frozenset({"browser", "office", "running"})


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """With ``--dist loadfile``, one process runs the files of a group of `TOGETHER`."""
    if config.getoption("dist") != "loadfile":
        return None
    from xdist.scheduler import LoadFileScheduling

    first = {name: names[0] for names in TOGETHER for name in names}

    class LoadGroups(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file: str = super()._split_scope(nodeid)
            return first.get(file, file)

    return LoadGroups(config, log)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the files that take long, and in a group of `TOGETHER` with the tests that need nothing shared.

    What the group shares ends before a test that needs none of it, and its start takes ten seconds.
    """
    places = {ROOT / "tests" / name: place for place, name in enumerate(LONG)}
    groups = {
        ROOT / name: [places.get(ROOT / other, len(LONG)) for other in names] for names in TOGETHER for name in names
    }

    def order(item: pytest.Item) -> tuple[int, bool]:
        if item.path not in groups:
            return places.get(item.path, len(LONG)), False
        return min(groups[item.path]), not SHARED.isdisjoint(getattr(item, "fixturenames", ()))

    items.sort(key=order)


def pytest_collection_finish() -> None:
    """From here on there is garbage, but not among what was imported."""
    gc.freeze()
    gc.enable()


@dataclass(frozen=True)
class Finished:
    """How a command ended."""

    code: int
    out: str
    err: str

    @property
    def data(self) -> Any:
        """Standard output as JSON."""
        return json.loads(self.out)

    @property
    def failure(self) -> Any:
        """Why a command with ``--json`` failed: the object on standard error (of `validate`, on standard output)."""
        return json.loads((self.err or self.out).splitlines()[-1])


@pytest.fixture(autouse=True)
def _levels_of_before() -> Iterator[None]:
    """A test that sets up the program's log leaves the others' levels as they were."""
    loggers = [logging.getLogger(name) for name in ("sprag", "sprag.requests")]
    levels = [logger.level for logger in loggers]
    yield
    for logger, level in zip(loggers, levels, strict=True):
        logger.setLevel(level)


@pytest.fixture
def sprag(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Callable[..., Finished]:
    """Runs a command, such as ``sprag("fit", path, "--accuracy", "0.05")``, in this process."""
    from sprag_study.service.cli.app import execute

    monkeypatch.delenv("SPRAG_DEBUG", raising=False)
    monkeypatch.delenv("SPRAG_SERVER", raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", os.devnull)  # no login of whoever runs the tests

    def run(*arguments: object) -> Finished:
        capsys.readouterr()
        code = execute([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        assert "bug in Sprag" not in captured.err
        return Finished(code, captured.out, captured.err)

    return run


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands write to a wide terminal without colours."""
    monkeypatch.setattr(CaptureIO, "isatty", lambda stream: stream is sys.stdout)
    for name, value in {"TERM": "dumb", "COLUMNS": "2000", "LINES": "100"}.items():
        monkeypatch.setenv(name, value)


@pytest.fixture(scope="session")
def examples() -> Path:
    """Folder of the example studies."""
    return ROOT / "examples"


@pytest.fixture(scope="session")
def empty_database(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A database without studies, made once."""
    from sprag_study.service.storage.store import Store
    from tests import statements

    statements.share()
    path = tmp_path_factory.mktemp("empty") / "sprag.sqlite3"
    with Store.open(f"sqlite:///{path}") as store:
        store.backup(path.with_suffix(".copy"))
    return path.with_suffix(".copy").read_bytes()


@pytest.fixture
def sqlite_url(tmp_path: Path, empty_database: bytes) -> str:
    """URL of a database of this test with the tables and nothing in them; ``sprag.sqlite3`` in its folder."""
    file = tmp_path / "sprag.sqlite3"
    file.write_bytes(empty_database)
    return f"sqlite:///{file}"


@pytest.fixture(scope="session")
def postgres_server() -> Iterator[postgres.Server]:
    """A PostgreSQL server that tests leave running; skipped where there is none, and a failure in the gate."""
    with postgres.running() as server:
        yield server


@pytest.fixture(scope="session")
def _ready_database(postgres_server: postgres.Server) -> str:
    from sprag_study.service.storage.store import Store
    from tests import statements

    statements.share()
    url = postgres_server.url(postgres_server.new_database())
    Store.open(url).close()
    return url


@pytest.fixture
def postgres_url(_ready_database: str) -> str:
    """URL of a database on the server with the tables and nothing in them; one test after the other has it."""
    postgres.empty(_ready_database)
    return _ready_database
