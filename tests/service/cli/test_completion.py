"""Completion by the shells, and the help that it shows."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import typer

from sprag_study.service.actor import Role
from sprag_study.service.cli import completion
from sprag_study.service.cli.app import command_line
from sprag_study.service.settings import Settings
from sprag_study.service.storage.people.scopes import TokenScope
from sprag_study.worker.models import ENDING_SENTENCES, REGIME_SENTENCES, flags_of, model_names
from tests.conftest import ROOT
from tests.service.conftest import Service
from tests.serving import served

Sprag = Callable[..., Any]

#: Prints what bash offers for the last of its arguments.
BASH = """
eval "$COMPLETION"
complete -p sprag >&2
COMP_WORDS=(sprag "$@"); COMP_CWORD=$#
_sprag_completion sprag
printf '%s\n' "${COMPREPLY[@]}"
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """An environment whose PATH has the command `sprag`, with what it gives bash to read as `COMPLETION`."""
    script = tmp_path_factory.mktemp("bin") / "sprag"
    script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m sprag_study.service.cli "$@"\n')
    script.chmod(0o755)
    path = f"{script.parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "PYTHONPATH": str(ROOT)}
    asked = subprocess.run(
        ["sprag"], env={**environment, "_SPRAG_COMPLETE": "source_bash"}, executable=script, capture_output=True,
        text=True, check=True,
    )  # fmt: skip
    return {**environment, "COMPLETION": asked.stdout}


@pytest.fixture
def program(installed: dict[str, str], tmp_path: Path) -> dict[str, str]:
    """That environment with a home of the test's own."""
    return {**installed, "HOME": str(tmp_path)}


def offered(program: dict[str, str], *words: str) -> list[str]:
    """What bash offers for the last word."""
    done = subprocess.run(["bash", "-c", BASH, "bash", *words], env=program, capture_output=True, text=True, check=True)
    assert done.stderr == "complete -o default -F _sprag_completion sprag\n"
    return done.stdout.split()


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_bash_completes_commands_options_and_choices(program: dict[str, str]) -> None:
    assert offered(program, "s") == ["submit", "show", "study", "schedule", "serve", "settings"]
    assert offered(program, "study", "ex") == ["extend"]
    assert offered(program, "show", "latest", "e") == ["explore", "engagements"]
    assert offered(program, "admin", "db", "up") == ["upgrade"]
    assert offered(program, "export", "--pro") == ["--project"]
    assert offered(program, "export", "--format", "p") == ["parquet", "pdf"]


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_bash_completes_studies_of_the_service(program: dict[str, str], service: Service, spec: dict[str, Any]) -> None:
    first = service.submit({**spec, "name": "feeder"})
    second = service.submit({**spec, "name": "two words"})
    with served(service.app) as address:
        program["SPRAG_SERVER"] = address
        assert offered(program, "study", "watch", "") == ["latest", second, first]
        assert offered(program, "compare", "latest", "fe") == ["feeder"]
        assert offered(program, "study", "watch", "two") == [], "a name that needs quotes"
    assert offered(program, "study", "watch", "") == [], "no service answers"


def test_schedules_tokens_and_users_are_completed(
    service: Service, spec: dict[str, Any], settings: Settings, tmp_path: Path
) -> None:
    def given(**params: object) -> typer.Context:
        context = typer.Context(command_line("en"))
        context.params = params
        return context

    kept = service.http.post("/api/v1/schedules", json={"spec": spec, "cron": "@daily", "name": "nightly"}).json()
    _, token = service.store.people.create_token("laptop", TokenScope.READ)
    service.store.people.revoke_token(service.store.people.create_token("old", TokenScope.READ)[1].id)
    service.store.people.add_user("dora", Role.VIEWER)
    own = given(db=settings.database)
    assert completion.tokens(own, "") == [(token.id, "laptop, read")]
    assert ("laptop", token.id) in completion.tokens(own, "la")
    assert completion.users(own) == [("dora", "viewer")]
    none = tmp_path / "none.sqlite3"
    assert completion.users(given(db=str(none))) == []
    assert not none.exists()
    secret, _ = service.store.people.create_token("", TokenScope.READ)
    with served(service.app) as address:
        context = given(server=address, token=secret)
        assert completion.schedules(context, "") == [(kept["id"], "nightly, @daily")]
        assert completion.schedules(context, "ni")[1:] == [("nightly", kept["id"])]


def test_options_are_completed(
    sprag: Sprag, monkeypatch: pytest.MonkeyPatch, service: Service, spec: dict[str, Any]
) -> None:
    """By what the program says to bash."""
    monkeypatch.setenv("_SPRAG_COMPLETE", "complete_bash")

    def offers(*words: str) -> list[str]:
        monkeypatch.setenv("COMP_WORDS", " ".join(("sprag", *words)))
        monkeypatch.setenv("COMP_CWORD", str(len(words)))
        return list(sprag().out.split())

    study = service.submit({**spec, "name": "feeder"})
    case = service.get(f"/studies/{study}/cases/0")
    with served(service.app) as address:
        monkeypatch.setenv("SPRAG_SERVER", address)
        quantities = [*case["parameters"], *case["results"]]
        assert offers("show", study, "cases", "--sort", "") == ["case", "ending", "flags", *quantities]
        assert offers("show", "fee", "cases", "--sort", "shaft.l") == ["shaft.load"]
        assert offers("show", "latest", "explore", "--limit", "3", "--show", "") == quantities
        assert offers("show", study, "curves", "--x", "") == [*case["parameters"]]
        assert offers("compare", study, "latest", "--y", "eff") == ["efficiency"]
        assert offers("show", "cases", "--sort", "") == ["case", "ending", "flags"], "no study is named yet"
        assert offers("models", "") == [m["name"] for m in service.get("/models")["models"]]
        assert offers("list", "--model", "m") == ["machine-shaft"]
    assert offers("show", study, "cases", "--sort", "shaft") == [], "no service answers"
    with served(service.app) as address:
        typed = "--server", address
        assert offers(*typed, "study", "watch", "fee") == ["feeder"], "the service that is typed answers"
        assert offers("study", *typed, "watch", "fee") == ["feeder"]
        assert offers("list", *typed, "--json", "--model", "m") == ["machine-shaft"]
        assert offers("show", study, "cases", *typed, "--sort", "shaft.l") == ["shaft.load"]
    assert offers("list", "--server", "h") == []
    assert offers("show", study, "cases", "--ending", "c") == [
        "chatter",
        "cannot_assemble",
        "crashed",
        "cancelled",
    ]
    assert offers("show", study, "cases", "--regime", "") == [*REGIME_SENTENCES][1:]
    assert offers("show", study, "explore", "--flag", "un") == ["unsettled"]
    assert offers("study", "retry", study, "--ending", "chat") == ["chatter"]
    assert offers("presets", "p") == ["press", "punching_press"]
    assert offers("list", "--sort", "n") == ["newest", "name"]


def test_every_ending_and_flag_is_offered() -> None:
    assert set(completion.endings()) == set(map(str, ENDING_SENTENCES))
    assert set(completion.flags()) == {flag for model in model_names() for flag in flags_of(model)}


@pytest.mark.parametrize(
    ("shell", "variables", "expected"),
    [
        ("zsh", {"_TYPER_COMPLETE_ARGS": "sprag exp"}, '"export":"Write all'),
        (
            "fish",
            {"_TYPER_COMPLETE_ARGS": "sprag exp", "_TYPER_COMPLETE_FISH_ACTION": "get-args"},
            "export\tWrite all",
        ),
    ],
)
def test_other_shells_complete_too(
    sprag: Sprag, monkeypatch: pytest.MonkeyPatch, shell: str, variables: dict[str, str], expected: str
) -> None:
    monkeypatch.setenv("_SPRAG_COMPLETE", f"source_{shell}")
    script = sprag()
    assert script.code == 0
    assert f"_SPRAG_COMPLETE=complete_{shell}" in script.out
    monkeypatch.setenv("_SPRAG_COMPLETE", f"complete_{shell}")
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert expected in sprag().out


def test_an_unknown_shell_is_refused(sprag: Sprag, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_SPRAG_COMPLETE", "source_csh")
    done = sprag()
    assert (done.code, done.err) == (1, "Shell csh not supported.\n")


def test_h_is_help(sprag: Sprag) -> None:
    for command in ([], ["run"], ["show"], ["show", "curves"], ["admin", "db"], ["admin", "db", "upgrade"]):
        done = sprag(*command, "-h")
        assert done.code == 0
        assert done.out == sprag(*command, "--help").out
        assert "-h, --help" in done.out


def test_help_lists_every_command_with_its_first_sentence(sprag: Sprag) -> None:
    commands = command_line("en").commands  # type: ignore[attr-defined]
    shown = " ".join(sprag("-h").out.split())
    for name in commands:
        assert f" {name} {commands.words[name].summary}" in shown
    assert "..." not in shown.replace("[ARGS]...", "")
    titles = [shown.index(title) for title in ("Studies:", "A service:", "Administration:")]
    assert titles == sorted(titles)


def test_help_of_a_command_names_the_options_of_its_group(sprag: Sprag) -> None:
    said = " ".join(sprag("schedule", "add", "-h").out.split())
    assert "More, which `sprag schedule -h` explains: --cron FIELDS Recurring --at TIME Once, such as" in said
    assert " -o, --output FILE File to write --units" in " ".join(sprag("show", "curves", "-h").out.split())
    explained = "`sprag -h` explains --json, --server, --token, --language, which every command has."
    for line in (("list",), ("admin", "db", "backup"), ("show", "map")):
        assert explained in " ".join(sprag(*line, "-h").out.split())
    assert "range>" not in sprag("run", "-h").out


def test_a_group_without_a_command_shows_its_help(sprag: Sprag) -> None:
    done = sprag("admin", "db")
    assert (done.code, done.out) == (2, "")
    assert done.err == sprag("admin", "db", "--help").out
