"""The command line in other languages: which one is chosen, no text left in English, JSON the same bytes in all."""

from __future__ import annotations

import io
import json
import re
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import typer
from anyio.from_thread import BlockingPortal

from sprag_study.service import client as clients
from sprag_study.service import languages
from sprag_study.service.cli.app import command_line
from sprag_study.service.cli.console import (
    ExitCode,
    WrongInputError,
    confirmed,
    duration_text,
    fault_line,
    warning_lines,
)
from sprag_study.service.cli.following import show_study
from sprag_study.service.cli.language import chosen, refusal
from sprag_study.service.client import Client, RefusedError
from sprag_study.service.fault_meanings import MEANINGS, WARNING_MEANINGS
from sprag_study.service.faults import Fault
from sprag_study.service.languages.catalogue import Catalogue, Entry
from sprag_study.service.languages.recorded import LATE
from tests.service.conftest import PortalTransport, Service
from tests.service.spec_sample import SPEC, changed

Sprag = Callable[..., Any]

#: Text in the pseudo-language, and what may stand outside it: names of options, commands, codes, files and numbers.
MARKED = re.compile(r"⟦[^⟦⟧]*⟧")
WORD = re.compile(r"[A-Za-z]{2,}")
#: The only values of an option: ``[heatmap|contour]``.
CHOICES = re.compile(r"\[[\w-]+(?:\|\s*[\w-]+)+\]")
NAMES = re.compile(
    r"--?[a-z][\w-]*|<[^>]*>|\b[a-z]+_\w+|[\w/-]+\.[\w./-]*\w|\b[A-Z][A-Z_]+\b"
    r"|[\w.]+@[\w.]+|https?://\S+|\[[\w*/^]+\]|\{[a-z]+\}"
)


@pytest.fixture(scope="module")
def bracketed() -> Iterator[Catalogue]:
    """A catalogue that wraps each text in brackets; the command line that is made of it serves all tests."""
    ours = languages.catalogue("uk")
    entries = {
        key: entry if key.context else Entry(tuple(_wrapped(key.text) for _ in entry.forms), entry.many)
        for key, entry in ours.entries.items()
    }
    command_line.cache_clear()
    yield Catalogue(ours.header, entries)
    command_line.cache_clear()


@pytest.fixture
def pseudo(bracketed: Catalogue, monkeypatch: pytest.MonkeyPatch) -> None:
    """A language that wraps each text of the catalogues in brackets."""
    ours = languages.catalogue("uk")
    monkeypatch.setattr(languages, "available", lambda: ("en", "uk", "xx"))
    monkeypatch.setattr(languages, "catalogue", lambda code: bracketed if code == "xx" else ours)
    monkeypatch.setenv("SPRAG_LANGUAGE", "xx")


def _wrapped(text: str) -> str:
    """A text in the pseudo-language; its sentences end with another point: lists of commands show the first only."""
    return "\n\n".join(f"⟦{part.replace('. ', '․ ')}⟧" for part in text.split("\n\n"))


def unmarked(text: str, names: tuple[str, ...] = ()) -> list[str]:
    """The words of a text that no catalogue has."""
    before = ""
    while before != text:
        before, text = text, MARKED.sub(" ", text)
    text = CHOICES.sub(" ", re.sub("(?m)⟦[^⟦⟧\n]*$(?:\n {16,}.*)?", " ", text))  # the first part of a text has no end
    for name in sorted(names, key=len, reverse=True):
        text = re.sub(rf"(?<![\w.-]){re.escape(name)}(?![\w-])", " ", text)
    return WORD.findall(NAMES.sub(" ", text))


def commands(command: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """The words of each command, such as ("db", "check")."""
    yield path
    for name, inner in getattr(command, "commands", {}).items():
        yield from commands(inner, (*path, name))


COMMANDS = list(commands(command_line("en")))


@pytest.mark.parametrize(
    ("arguments", "environment", "expected"),
    [
        ([], {}, ""),
        (["list"], {"LANG": "uk_UA.UTF-8"}, "uk"),
        (["list"], {"LANG": "uk_UA.UTF-8", "LC_ALL": "C.UTF-8"}, "c"),
        (["list"], {"LANG": "C", "LC_MESSAGES": "uk_UA"}, "uk"),
        (["list"], {"LANG": "uk_UA.UTF-8", "SPRAG_LANGUAGE": "en"}, "en"),
        (["--language", "uk", "list"], {"SPRAG_LANGUAGE": "en"}, "uk"),
        (["--language=uk", "list"], {}, "uk"),
        (["--server", "http://a", "--token=x", "--language", "uk", "list"], {}, "uk"),
        (["list", "--language", "uk"], {}, ""),
        (["list"], {"SPRAG_LANGUAGE": "uk_UA.UTF-8"}, "uk"),
        (["list", "--json"], {"SPRAG_LANGUAGE": "uk"}, "en"),
        (["--language", "uk", "list", "--json"], {}, "en"),
        (["--language"], {}, ""),
    ],
)
def test_the_language_is_chosen(arguments: list[str], environment: dict[str, str], expected: str) -> None:
    assert chosen(arguments, environment) == expected


def test_the_name_of_a_system_language_is_a_language(sprag: Sprag, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPRAG_LANGUAGE", "uk_UA")
    assert sprag("settings", "--help").out.startswith("Використання: ")


def test_a_stored_reason_is_shown_in_the_language(capsys: pytest.CaptureFixture[str]) -> None:
    progress = {"done": 1, "total": 2, "ok": 1}
    reason = LATE.format(time="2026-01-01T06:00Z", done=1, cases=2)
    study = {"id": "st_1", "name": "one", "model": "m", "state": "paused", "time_over": True, "reason": reason}
    with languages.language("uk"):
        show_study({**study, "progress": progress})
        expected = languages.gettext(LATE, time="2026-01-01T06:00Z", done=1, cases=2)
    told = " ".join(capsys.readouterr().err.split())
    assert expected in told
    assert reason not in told


def test_a_language_that_is_not_there_is_refused_with_those_that_are(sprag: Sprag) -> None:
    refused = sprag("--language", "tlh", "settings")
    assert refused.code == 2
    assert "--language: is not a language of this program (got 'tlh'; allowed: en, uk)" in refused.err


def test_help_is_in_the_language(sprag: Sprag, monkeypatch: pytest.MonkeyPatch) -> None:
    english = sprag("run", "--help").out
    monkeypatch.setenv("SPRAG_LANGUAGE", "uk")
    ukrainian = sprag("run", "--help").out
    assert ukrainian.startswith("Використання: sprag run [OPTIONS] {SPEC}\n")
    assert f"[{languages.catalogue('uk').text('required')}]" in ukrainian
    assert "Показати цю довідку й завершити роботу." in ukrainian
    assert sprag("--language", "en", "run", "--help").out == english


@pytest.mark.usefixtures("pseudo")
@pytest.mark.parametrize("path", COMMANDS, ids=lambda path: " ".join(path) or "sprag")
def test_help_has_no_text_without_a_translation(sprag: Sprag, path: tuple[str, ...]) -> None:
    shown = sprag(*path, "--help")
    assert shown.code == 0
    assert shown.out.count("⟦") >= 4
    names = {name for words in COMMANDS for name in words}
    assert unmarked(shown.out, ("sprag", "priority", "part", *names)) == []


#: Refusals by typer of a command line, and of what a command reads.
REFUSED = (
    ["run"],
    ["nonsense"],
    ["run", "--nonsense", "x"],
    ["run", "x.json", "--file"],
    ["run", "x.json", "more"],
    ["check", "x.json", "--json=1"],
    ["show", "x.json", "trajectory", "--case", "-1"],
    ["show", "x.json", "trajectory", "--case", "one"],
    ["run", "x.json", "--format", "xml"],
    ["fit", "x.csv"],
    ["admin", "user", "change", "dora"],
    ["study", "extend", "latest"],
    ["study", "extend", "latest", "--axis", "load"],
    ["study", "extend", "latest", "--axis", "shaft.load=1,234"],
    ["show", "latest", "case", "--points", "5"],
    ["compare", "latest"],
    ["schedule", "change", "sc_1"],
    ["presets", "one_pendulun"],
    ["admin", "doctor", "--pendulums", "3"],
    ["show", "latest", "answers", "-o", "curve.xlsx"],
)


@pytest.mark.usefixtures("pseudo")
@pytest.mark.parametrize("arguments", REFUSED, ids=" ".join)
def test_a_refused_command_line_has_no_text_without_a_translation(sprag: Sprag, arguments: list[str]) -> None:
    refused = sprag(*arguments)
    assert refused.code == 2
    assert "⟦" in refused.err
    given = tuple(part for text in arguments for part in (text, *text.split("=")) if len(part) > 2)
    choices = ("csv", "json", "one_pendulun", "xlsx", *(name for words in COMMANDS for name in words))
    assert unmarked(refused.err, (*given, *choices, "sprag")) == []


@pytest.mark.usefixtures("files")
def test_a_deadline_is_refused_in_a_whole_sentence(sprag: Sprag) -> None:
    line = ("run", "study.json", "-o", "rows.csv", "--finish-by", "2020-01-01T00:00Z")
    assert "--finish-by: is in the past; it is 20" in sprag(*line).err
    refused = sprag("--language", "uk", *line).err
    assert "--finish-by: у минулому; тепер 20" in refused
    assert "від 1 с до 366 днів наперед" in refused
    assert "past" not in refused


def test_an_unknown_refusal_stays_as_it_is(pseudo: None) -> None:
    with languages.language("xx"):
        assert refusal("Something else.") == "Something else."
        assert refusal("Missing option '--y'.") == "⟦the option '--y' is missing⟧"
    assert refusal("Missing option '--y'.") == "Missing option '--y'."


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A spec and measured data in the folder of the test."""
    import json

    monkeypatch.chdir(tmp_path)
    Path("study.json").write_text(json.dumps(SPEC), encoding="utf-8")
    Path("clutch.csv").write_text("angle_rad,torque_Nm\n0.01,2.1\n0.02,4.4\n0.03,7.2\n0.04,10.9\n", encoding="utf-8")


#: Commands that need no service, with the names in what they show.
LOCAL: dict[str, tuple[str, ...]] = {
    "check study.json": ("Hz",),
    "fit clutch.csv --accuracy 0.5": ("RMS", "clutch", "coefficients", "windup_limit"),
    "show study.json trajectory --points 5 -o motion.csv": ("ok",),
    "show study.json engagements -o engagements.csv": (),
    "admin user add dora --db users.sqlite3": ("dora", "designer"),
    "admin user list --db users.sqlite3": ("dora", "designer"),
    "admin token create --name laptop --db users.sqlite3": ("laptop", "write"),
    "admin token list --db users.sqlite3": (),
    "admin db upgrade --db some.sqlite3": (),
    "admin db prune --older-than 3 --db users.sqlite3": (),
}


@pytest.mark.usefixtures("pseudo", "files", "terminal")
@pytest.mark.parametrize("line", LOCAL)
def test_commands_say_nothing_without_a_translation(sprag: Sprag, line: str) -> None:
    if "users.sqlite3" in line:
        sprag("admin", "db", "upgrade", "--db", "users.sqlite3")
    if "users.sqlite3" in line and "add" not in line:
        sprag("admin", "user", "add", "dora", "--db", "users.sqlite3")
    done = sprag(*line.split(" "))
    assert done.code == 0, done.err
    messages = done.err if line.startswith("admin token create") else done.out + done.err
    assert "⟦" in messages
    assert unmarked(messages, (*LOCAL[line], str(SPEC["name"]), "SQLite", "sqlite")) == []


@pytest.fixture
def here(service: Service, portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands ask the service of the test, whose answers are English like those of any other."""
    transport = PortalTransport(service.app, portal)
    handle = transport.handle_request

    def in_english(request: Any) -> Any:
        with languages.language(languages.ENGLISH):
            return handle(request)

    monkeypatch.setattr(transport, "handle_request", in_english)
    monkeypatch.setattr(clients, "Client", partial(Client, transport=transport))


#: Commands for a service, with the names in what they show.
REMOTE: dict[str, tuple[str, ...]] = {
    "list": ("finished", "queued", "running"),
    "study pause latest": (),
    "show latest curves": ("ok", "Hz", "chatter"),
    "show latest answers --at excitation.frequency=16": (
        "efficiency",
        "shaft.load",
        "rad",
        "Hz",
        "excitation.frequency",
    ),
    "show latest cases --result efficiency": ("efficiency", "ok", "Hz", "chatter"),
    "show latest explore": ("ok", "Hz", "chatter"),
    "models": ("vibration-drive", "machine-shaft"),
    "admin workers": (),
    "study edit latest --name Feeder": ("Feeder",),
    "study delete latest --yes": (),
    "schedule list": (),
}


@pytest.mark.usefixtures("pseudo", "here", "terminal")
@pytest.mark.parametrize("line", REMOTE)
def test_commands_for_a_service_say_nothing_without_a_translation(sprag: Sprag, service: Service, line: str) -> None:
    study = service.submit()
    if not line.startswith("study pause"):
        service.fill(study)
    done = sprag(*line.split(" "))
    assert done.code in (0, 4), done.err
    assert "⟦" in done.out + done.err
    known = ("vibration-drive", "efficiency", str(SPEC["name"]))
    assert unmarked(done.out + done.err, (*REMOTE[line], *known)) == []


@pytest.mark.usefixtures("here")
def test_json_is_the_same_in_every_language(sprag: Sprag, service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    study = service.submit()
    service.fill(study)
    lines = (
        "list",
        f"show {study} case",
        f"show {study} curves",
        "models",
        f"study watch {study}",
        "presets",
        "nowhere",
    )
    english = [sprag(*line.split(" "), "--json") for line in lines]
    monkeypatch.setenv("LANG", "uk_UA.UTF-8")
    monkeypatch.setenv("SPRAG_LANGUAGE", "uk")
    assert [sprag(*line.split(" "), "--json") for line in lines] == english


@pytest.mark.usefixtures("here")
def test_tables_for_programs_are_the_same_in_every_language(
    sprag: Sprag, service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = service.submit()
    service.fill(study)
    whats = ("case", "cases", "curves", "answers", "explore", "rounds")
    lines = ["list", "presets", "models", "schedule list", *(f"show {study} {what}" for what in whats)]
    english = [sprag(*line.split(" ")).out for line in lines]
    assert all("\t" in out for out in english)
    monkeypatch.setenv("SPRAG_LANGUAGE", "uk")
    assert [sprag(*line.split(" ")).out for line in lines] == english


@pytest.mark.usefixtures("files")
def test_rows_are_the_same_in_every_language(sprag: Sprag, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = (
        "show study.json trajectory --points 5",
        "show study.json engagements",
        "presets one_pendulum",
        "admin audit --db a.sqlite3",
    )
    sprag("admin", "db", "upgrade", "--db", "a.sqlite3")
    english = [sprag(*line.split(" ")).out for line in lines]
    monkeypatch.setenv("SPRAG_LANGUAGE", "uk")
    assert [sprag(*line.split(" ")).out for line in lines] == english


@pytest.mark.parametrize(
    ("language", "typed", "expected"),
    [
        ("en", "y\n", True),
        ("en", "n\n", False),
        ("en", "\n", False),
        ("en", "так\nyes\n", True),
        ("uk", "т\n", True),
        ("uk", "Так\n", True),
        ("uk", "y\n", True),
        ("uk", "ні\n", False),
        ("uk", "maybe\nn\n", False),
    ],
)
def test_questions_are_answered_in_english_or_in_the_language(
    language: str, typed: str, expected: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(typed))
    with languages.language(language):
        assert confirmed("?") is expected
    assert capsys.readouterr().err.startswith("? [y/N]: " if language == "en" else "? [т/Н]: ")


def test_a_question_at_the_end_of_the_input_is_not_answered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(""))
    with pytest.raises(typer.Abort):
        confirmed("?")


def test_a_fault_without_a_translation_is_told_by_its_code() -> None:
    """Its own sentence follows, because it can say more."""
    fault = Fault("/base/shaft/load", "out-of-range", "must not be so small", -1.5, "0 to 1e9", "N*m")
    failure = WrongInputError("invalid-spec", "the spec is not valid", [fault])
    english = ["the spec is not valid", f"  {fault}"]
    assert list(failure.lines()) == english
    with languages.language("uk"):
        meaning = languages.gettext(MEANINGS["out-of-range"]).removesuffix(".")
        assert list(failure.lines())[1:] == [
            f"  /base/shaft/load: {meaning} (задано -1.5; дозволено: 0 to 1e9; одиниця Н·м)",
            "    must not be so small",
        ]
        own = WrongInputError("invalid-parameter", "x", [Fault("--case", "unknown-name", "there is no such case", 7)])
        assert list(own.lines())[1:] == ["  --case: такого випадку немає (задано 7)"]


def test_warnings_have_the_meaning_of_their_code_before_their_sentence() -> None:
    warnings, codes = ["the run is short", "without a code"], ["short-window", None]
    assert list(warning_lines(warnings, codes)) == ["warning: the run is short", "warning: without a code"]
    with languages.language("uk"):
        meaning = languages.gettext(WARNING_MEANINGS["short-window"])
        assert meaning != WARNING_MEANINGS["short-window"]
        assert list(warning_lines(warnings, codes)) == [
            f"застереження: {meaning} (the run is short)",
            "застереження: without a code",
        ]


def test_exit_codes_and_durations_in_ukrainian() -> None:
    with languages.language("uk"):
        assert ExitCode.NOT_ALL_OK.sentence == "деякі випадки не завершилися успішно, або щось із ночі потребує уваги"
        assert [duration_text(s) for s in (0.42, 12.0, 200.0, 7500.0)] == ["0,4 с", "12 с", "3 хв 20 с", "2 год 05 хв"]


def test_a_refusal_of_a_service_keeps_the_values_of_its_sentences(service: Service) -> None:
    spec = {**SPEC, "base": {**SPEC["base"], "shaft": {**SPEC["base"]["shaft"], "load": "-2 N*m"}}}
    answer = service.http.post("/api/v1/studies", json=spec)
    fault = next(fault for fault in RefusedError(answer.status_code, answer.json()).faults if fault.allowed)
    with languages.language("uk"):
        line = fault_line(fault)
    assert "дозволено: >= 0 Н·м" in line
    assert not re.search(r"[a-z]{4,} [a-z]{2,}", line.partition(": ")[2])
    again = json.loads(json.dumps(answer.json()))
    for error in again["errors"]:
        error["sentences"] = {"message": {"text": 3}, "allowed": []}
    assert [str(fault) for fault in RefusedError(422, again).faults] == [
        str(fault) for fault in RefusedError(422, answer.json()).faults
    ]


def test_a_report_of_a_run_has_the_language_of_the_option_as_one_of_an_export(
    sprag: Sprag, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec, report = tmp_path / "spec.json", tmp_path / "report.html"
    spec.write_text(json.dumps(changed({"/axes": [{"path": "shaft.load", "values": [0.1, 0.2]}]})), "utf-8")
    monkeypatch.setenv("SPRAG_LANGUAGE", "uk")
    for typed, language in (((), "en"), (("--language", "uk"), "uk")):
        done = sprag(*typed, "run", spec, "-o", report)
        assert (done.code, "виконано випадків" in done.err) == (0, True), done.err
        assert f'<html lang="{language}"' in report.read_text("utf-8")
