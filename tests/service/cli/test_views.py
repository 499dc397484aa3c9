"""Commands of views: a spec, which is run here, and a study of a service give the same answer by the same options."""

from __future__ import annotations

import csv
import json
import math
import re
from typing import TYPE_CHECKING, Any

import pytest
import typer

from sprag_study.service.cli import case_views, remote
from sprag_study.service.cli import sources as of_commands
from sprag_study.service.cli.app import command_line
from sprag_study.service.cli.console import cell_text
from sprag_study.service.exports.decimal_commas import with_commas
from sprag_study.service.views.answers import AnswersView
from sprag_study.service.views.case_questions import CASE_VIEWS
from sprag_study.service.views.cases import CASE_VIEWS as VIEWS_OF_CASES
from sprag_study.service.views.setting import settings_of
from sprag_study.service.views.studies import STUDY_VIEWS
from sprag_study.worker.models import run_chunk
from tests.service import conftest
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path
    from types import ModuleType

    from tests.conftest import Finished
    from tests.service.conftest import Service

_SMALL = {**SPEC, "axes": [{"path": "shaft.load", "values": ["0 N*m", "0.1 N*m", "0.2 N*m"]}]}


@pytest.fixture
def sources(
    service: Service, connected: Callable[[ModuleType], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[Path, str]:
    """The same study as a file, and run by a service."""
    monkeypatch.setattr(conftest, "made_up", lambda study: run_chunk(study, 0, study.cases))
    connected(remote)
    connected(case_views)
    file = tmp_path / "study.json"
    file.write_text(json.dumps(_SMALL))
    study_id = service.submit(_SMALL)
    service.fill(study_id)
    return file, study_id


@pytest.mark.parametrize(
    ("command", "options"),
    [
        ("curves", ("--y", "shaft.speed.mean", "--y", "efficiency")),
        ("answers", ("--point", "100 N*mm")),
        ("explore", ("--where", "shaft.load >= 0.1", "--sort=-efficiency")),
        ("sensitivity", ("--y", "shaft.speed.mean")),
    ],
)
def test_views_of_a_study(
    sprag: Callable[..., Finished], sources: tuple[Path, str], tmp_path: Path, command: str, options: tuple[str, ...]
) -> None:
    here, there = (_answer(sprag("show", source, command, *options, "--json")) for source in sources)
    assert here == there
    tables = []
    for number, source in enumerate(sources):
        file = tmp_path / f"{number}.csv"
        assert sprag("show", source, command, *options, "-o", file, "--units", "rpm").code == 0
        tables.append(file.read_bytes())
    assert tables[0] == tables[1]


def test_views_of_a_case(
    sprag: Callable[..., Finished], sources: tuple[Path, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, options in (("trajectory", ("--points", 5)), ("engagements", ()), ("strobes", ("--table", "strobes"))):
        here, there = (sprag("show", source, name, "--case", 1, *options, "--json") for source in sources)
        assert (here.code, there.code) == (0, 0), here.err + there.err
        assert json.loads(here.out) == json.loads(there.out)
    pictures = []
    for number, source in enumerate(sources):
        file = tmp_path / f"{number}.svg"
        for options in ((), ("--language", "uk")):
            with monkeypatch.context() as patch:  # the language of messages, which pictures have only on request
                patch.setenv("SPRAG_LANGUAGE", "uk")
                assert sprag("show", source, "strobes", "--case", 1, "-o", file, *options).code == 0
            pictures.append(file.read_text())
    assert pictures[:2] == pictures[2:]
    assert [bool(re.search("[а-яі]{3}", picture)) for picture in pictures[:2]] == [False, True]
    refused = sprag("show", sources[0], "engagements", "-o", tmp_path / "wrong.svg")
    assert (refused.code, "a name that ends in .csv, .json" in refused.err) == (2, True)
    refused = sprag("show", sources[1], "transient", "--kind", "run-up", "--all")
    assert (refused.code, "--all: belongs to a spec" in refused.err) == (2, True)


def test_tables_have_decimal_commas_where_they_are_asked_for(
    sprag: Callable[..., Finished], sources: tuple[Path, str], tmp_path: Path
) -> None:
    for name, options in (("curves", ()), ("strobes", ("--case", 1))):
        tables = []
        for number, source in enumerate(sources):
            file = tmp_path / f"{number}.csv"
            plain = sprag("show", source, name, *options, "-o", file).code, file.read_bytes()
            commas = sprag("show", source, name, *options, "-o", file, "--decimal", "comma").code, file.read_bytes()
            assert (plain[0], commas) == (0, (0, b"".join(with_commas([plain[1]]))))
            tables.append(commas)
        assert tables[0] == tables[1]
        refused = sprag("show", sources[0], name, *options, "-o", tmp_path / "a.svg", "--decimal", "comma")
        assert (refused.code, "--decimal: only CSV files have it" in refused.err) == (2, True)
    file = tmp_path / "settled.csv"
    assert sprag("show", sources[0], "settled", "--case", 1, "-o", file, "--decimal", "comma").code == 0
    assert file.read_text("utf-8-sig").splitlines()[1].startswith("1;0,1;")


def test_a_spec_takes_its_points_without_a_view_too(
    sprag: Callable[..., Finished], sources: tuple[Path, str], tmp_path: Path, connected: Callable[[ModuleType], None]
) -> None:
    connected(remote)
    points = tmp_path / "points.csv"
    points.write_text("shaft.load [N*mm]\n50\n75\n")
    done = sprag("show", sources[0], "--points", points)
    assert (done.code, "valid, 2 cases" in done.out) == (0, True), done.err
    assert "least_flywheel: valid, at most 1504 cases" in sprag("check", "least_flywheel").out
    done = sprag("show", sources[0], "curves", "--points", points, "--y", "shaft.speed.mean", "--json")
    assert json.loads(done.out)["curves"][0]["x"] == [0.05, 0.075]
    done = sprag("show", sources[1], "--points", points)
    assert (done.code, "--points: belongs to a spec" in done.err) == (2, True)


def test_motions_that_settle_are_those_of_a_study_too(
    sprag: Callable[..., Finished], sources: tuple[Path, str], service: Service, connected: Callable[[ModuleType], None]
) -> None:
    connected(remote)
    here, there = (sprag("show", source, "settled", "--case", 1, "--json") for source in sources)
    assert (here.code, json.loads(here.out)) == (there.code, json.loads(there.out))
    starts = {"count": 2, "ranges": {"shaft.initial_speed": ["0 rad/s", "30 rad/s"]}}
    spec = {**_SMALL, "run": {"until": "settled"}, "starts": starts}
    done = sprag("show", service.submit(spec), "regimes", "--case", 1, "--json")
    assert (done.code, sum(row["regime.share"] for row in json.loads(done.out)["regimes"])) == (0, 1.0), done.err


def _answer(done: Finished) -> dict[str, Any]:
    assert done.code == 0, done.err
    answer: dict[str, Any] = json.loads(done.out)
    answer.pop("study")
    return answer


def test_wrong_settings_name_their_options(
    sprag: Callable[..., Finished], sources: tuple[Path, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    done = sprag("show", sources[0], "curves", "--x", "shaft.lode")
    assert done.code == 2
    assert "--x: not an axis of this study; did you mean 'shaft.load'?" in done.err
    done = sprag("show", sources[0], "ribbon", "--quantile", "105%")
    assert (done.code, "--quantile: is no probability" in done.err) == (2, True)

    def run(*_: object, **__: object) -> None:
        raise AssertionError("the study is run before what is wrong is told")

    monkeypatch.setattr(remote, "run_parsed", run)
    done = sprag("show", sources[0], "front")
    assert (done.code, "(the whole spec): the study has no goal" in done.err) == (2, True)
    for arguments, named in (
        (("curves", "--x", "nonsense"), "--x"), (("curves", "--y", "nonsense"), "--y"),
        (("curves", "--at", "shaft.load=9 N*m"), "--at"), (("curves", "--rest", "bogus"), "--rest"),
        (("map", "--x", "shaft.load", "--y", "nonsense", "--z", "efficiency"), "--y"),
        (("answers", "--point", "3 kg"), "--point"), (("explore", "--where", "nonsense > 3"), "--where"),
        (("sensitivity", "--y", "nonsense"), "--y"), (("ribbon", "--y", "nonsense"), "--y"),
        (("yield", "nonsense > 3"), "--condition"), (("curves", "-o", "a.svg", "--language", "xx"), "--language"),
        (("curves", "-o", "a.csv", "--units", "bogus"), "--units"),
        (("curves", "--units", "rpm", "--json"), "JSON is in SI units"),
        (("curves", "--units", "bogus"), "--units"),
        (("curves", "--y", "speed"), "did you mean 'shaft.speed.mean'?"),
        (("cases", "--result", "wrong"), "--result"), (("cases", "--units", "bogus"), "--units"),
        (("cases", "--at", "nonsense=3"), "--at"), (("cases", "--where", "nonsense > 3"), "--where"),
        (("cases", "--sort", "nonsense"), "--sort"), (("cases", "--ending", "nonsense"), "--ending"),
        (("case", "--case", "9999"), "--case: there is no such case"), (("case", "--units", "bogus"), "--units"),
    ):  # fmt: skip
        done = sprag("show", sources[0], *arguments)
        assert (done.code, named in done.err) == (2, True), (arguments, done.err)
    two = sources[0].with_name("two.json")
    two.write_text(json.dumps(SPEC))
    for line, named in (
        (("export", sources[0], "--units", "bogus"), "--units"),
        (("compare", *sources, "--x", "nonsense"), "--x"), (("compare", *sources, "--y", "nonsense"), "--y"),
        (("compare", *sources, "--x", "shaft.load", "--by", "nonsense"), "--by"),
        (("compare", two, two, "--x", "shaft.load", "--at", "excitation.frequency=9 Hz"), "--at"),
        (("compare", two, two, "--at", "shaft.load=9 N*m"), "--at: the axis has no such value"),
        (("compare", two, "one_pendulum", "--at", "shaft.lod=0.1"), "--at: not an axis of this study; did you mean"),
        (("compare", two, two.with_name("missing.json")), "missing.json: no such file"),
        (("show", "fastest_drive", "case", "--case", 9999), "(got 9999; allowed: 0 .. "),
        (("show", "fastest_drive", "curves", "--x", "nonsense"), "--x"),
        (("show", "fastest_drive", "curves", "--y", "nonsense"), "--y"),
        (("show", "fastest_drive", "front", "--x", "nonsense"), "--x: is not a goal"),
        (("show", "fastest_drive", "cases", "--sort", "nonsense"), "--sort"),
        (("show", "fastest_drive", "calibration"), "the study is not a calibration"),
        (("show", "fastest_drive", "curves"), "so there is no curve (allowed: excitation.frequency, "),
        (("show", "fastest_drive", "map", "--x", "shaft.inertia", "--y", "excitation.frequency", "--z", "efficiency"),
         "--x: a map needs a grid"),
    ):  # fmt: skip
        done = sprag(*line)
        assert (done.code, named in done.err) == (2, True), (line, done.err)
    with pytest.raises(AssertionError, match="the study is run before"):  # its cases decide which values there are
        sprag("show", "refined_characteristic", "curves", "--at", "excitation.frequency=999")
    monkeypatch.setattr("sprag_study.service.views.case_view.see", run)
    done = sprag("show", sources[0], "strobes", "-o", "a.svg", "--language", "xx")
    assert (done.code, "--language: is not a language" in done.err) == (2, True), done.err


def test_cases_and_rows_of_a_spec_are_those_of_a_study(
    sprag: Callable[..., Finished], sources: tuple[Path, str], tmp_path: Path
) -> None:
    kept = tmp_path / "kept.sqlite3"
    assert sprag("run", sources[0], "--db", kept, "-o", tmp_path / "rows.csv").code == 0
    for line in (
        ("show", "cases", "--result", "efficiency"), ("show", "cases", "--units", "rpm, N*mm"),
        ("show", "case", "--case", 2), ("show", "case", "--units", "rpm"), ("show", "rounds"),
        ("export", "--units", "rpm"), ("show", "cases", "--where", "shaft.load >= 9"),
    ):  # fmt: skip
        word, *more = line
        here, there = sprag(word, sources[0], *more, "--db", kept), sprag(word, sources[1], *more)
        assert (here.code, there.code) == (0, 0), (line, here.err, there.err)
        assert here.out == there.out, line
    done = sprag("compare", *sources, "--json")
    assert done.code == 0, done.err
    here_curves, there_curves = (found["curves"] for found in done.data["curves"].values())
    assert here_curves == there_curves
    twice = sprag("compare", sources[0], sources[0], "--json")
    first, second = twice.data["studies"]
    assert (first.endswith(f"({sources[0]})"), second.endswith(f"({sources[0]}, 2)")) == (True, True), twice.data
    assert list(twice.data["curves"]) == [first, second]
    refused = sprag("compare", sources[1], sources[1], "--db", kept)
    assert (refused.code, "--db: belongs to a spec" in refused.err) == (2, True)


def test_programs_get_the_table_of_the_file(
    sprag: Callable[..., Finished], sources: tuple[Path, str], tmp_path: Path
) -> None:
    file = tmp_path / "file.csv"
    asked = ("curves --units rpm", "answers", "explore --limit 2", "sensitivity --y efficiency")
    for name, *options in map(str.split, asked):
        for source in sources:
            done = sprag("show", source, name, *options, "-o", file)
            rows = list(csv.reader(file.read_text("utf-8").splitlines()))
            shown = [line.split("\t") for line in done.out.splitlines()]
            assert (done.code, shown) == (0, rows[: len(shown)]), (name, done.err)


@pytest.mark.usefixtures("terminal")
def test_people_get_tables_in_their_units(sprag: Callable[..., Finished], sources: tuple[Path, str]) -> None:
    (curve,) = sprag("show", sources[1], "curves", "--y", "shaft.speed.mean", "--json").data["curves"]
    rpm = [cell_text(speed * 30 / math.pi) for speed in curve["y"]["shaft.speed.mean"]]
    for source in sources:
        table = sprag("show", source, "curves", "--y", "shaft.speed.mean", "--units", "rpm, N*mm").out
        assert {"shaft.speed.mean [rpm]", "shaft.load [N*mm]"} <= {*re.split(r" {2,}", table)}
        assert [
            line.split()[:2] for line in table.splitlines() if "ok" not in line and line.split()[:1] == ["100"]
        ] == [["100", rpm[1]]]
        assert f" {rpm[1]} " in sprag("show", source, "cases", "--result", "shaft.speed.mean", "--units", "rpm").out
        shown = sprag("show", source, "answers", "--point", "100 N*mm", "--units", "rpm, N*mm").out
        assert f" {rpm[1]} " in shown
        assert "shaft.load [N*mm]" in shown
    assert sprag("show", sources[1], "curves", "--units", "bogus").err.count("--units: ") == 1


def test_what_is_written_is_said_here_and_by_a_service(
    sprag: Callable[..., Finished], sources: tuple[Path, str], tmp_path: Path
) -> None:
    for source in sources:
        for name, form, said in (
            ("strobes", "svg", "picture"),
            ("trajectory", "svg", "picture"),
            ("trajectory", "csv", "table"),
        ):
            file = tmp_path / f"file.{form}"
            done = sprag("show", source, name, "--case", 1, "-o", file, "--json")
            assert done.err.splitlines()[-1] == f"{said}: {file}", source
            told = json.loads(done.out)
            assert (told["file"], told["case"]) == (str(file), 1)
            assert sprag("show", source, name, "--case", 1, "-o", file).out == ""


def test_a_view_of_a_spec_is_found_once_for_table_and_file(
    sprag: Callable[..., Finished], sources: tuple[Path, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: list[bool] = []
    genuine = AnswersView.find

    def find(self: AnswersView, *arguments: Any, **named: Any) -> Any:
        found.append(True)
        return genuine(self, *arguments, **named)

    monkeypatch.setattr(AnswersView, "find", find)
    for form in ("csv", "svg"):
        found.clear()
        assert sprag("show", sources[0], "answers", "-o", tmp_path / f"file.{form}").code == 0
        assert found == [True]


def test_a_service_finds_a_piped_view_once(
    sprag: Callable[..., Finished], sources: tuple[Path, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: list[bool] = []
    genuine = AnswersView.find

    def find(self: AnswersView, *arguments: Any, **named: Any) -> Any:
        found.append(True)
        return genuine(self, *arguments, **named)

    monkeypatch.setattr(AnswersView, "find", find)
    for options, count in (((), 1), (("--json",), 1), (("-o", tmp_path / "file.csv"), 2)):
        found.clear()
        assert sprag("show", sources[1], "answers", *options).code == 0
        assert len(found) == count, options


def test_choices_are_in_the_help_and_completed(sprag: Callable[..., Finished]) -> None:
    for command, name, choices in (
        ("transient", "kind", ["run-up", "load-step", "coasting"]), ("strobes", "table", ["strobes", "orbit"]),
        ("map", "kind", ["heatmap", "contour"]),
    ):  # fmt: skip
        assert f"[{'|'.join(choices)}]" in sprag("show", command, "--help").out
        (option,) = (one for one in command_line("en").commands["show"].commands[command].params if one.name == name)  # type: ignore[attr-defined]
        context = typer.Context(command_line("en"))
        first = choices[0]
        assert [item.value for item in option.shell_complete(context, first[:2])] == [first]


def test_every_view_has_a_command_with_its_settings() -> None:
    commands = command_line("en").commands["show"].commands  # type: ignore[attr-defined]
    named = {name: name for name in commands}
    abouts = {about.name: about for about in CASE_VIEWS} | {name: view.about for name, view in STUDY_VIEWS.items()}
    assert {about.name for about in CASE_VIEWS} == set(VIEWS_OF_CASES)
    for command, view in named.items():
        if view in abouts:
            options = {
                name
                for parameter in (*commands[command].params, *commands[command].shared)
                for name in (*parameter.opts, parameter.name)
            }
            asked = {
                one.name if one.setting.positional else one.option for one in settings_of(abouts.pop(view).question)
            }
            assert asked <= options, command
    assert not abouts


@pytest.mark.parametrize(
    ("argument", "study"),
    [("st_0123456789abcdef", True), ("feeder v1.2", True), ("folder", True), ("a/b", True), ("-", False),
     ("missing.json", False), ("spec.TOML", False), ("spec", False)],
)  # fmt: skip
def test_an_argument_is_a_study_or_a_spec(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, argument: str, study: bool
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "spec").write_text("{}")
    assert of_commands.is_study(argument) is study
