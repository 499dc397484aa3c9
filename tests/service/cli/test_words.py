"""The words of the command line: how many there are, what their help costs, and the names that they had before."""

from __future__ import annotations

import json
import os
import stat
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
import typer

from sprag_study.service.cli import common, components, doctor
from sprag_study.service.cli.app import command_line
from sprag_study.service.cli.groups import common_first
from sprag_study.service.cli.old_words import OLD, forwarded, without_gone
from sprag_study.service.client import Client
from sprag_study.service.login import DEFAULT_SERVER, access_of
from sprag_study.service.login import profile_file as login_file
from sprag_study.service.storage.people.scopes import TokenScope
from tests.conftest import Finished
from tests.service.conftest import Service
from tests.serving import served

Sprag = Callable[..., Finished]


def leaves(command: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Every command with its words."""
    yield path, command
    for name, inner in getattr(command, "commands", {}).items():
        yield from leaves(inner, (*path, name))


#: Options that no help lists: what installs completion, what 1.0.0 has, and what a kernel of the doctor is for.
HIDDEN = {"--install-completion", "--show-completion", "--format", "--pendulums", "--coefficients", "--tolerance"}


def test_there_are_twenty_words_and_few_options(sprag: Sprag) -> None:
    assert len(command_line().commands) <= 20
    assert len(sprag("--help").out.splitlines()) <= 45
    assert len(sprag("--language", "uk", "--help").out.splitlines()) <= 45
    options = [
        option
        for _, command in leaves(command_line())
        for option in command.params
        if option.param_type_name == "option"
    ]
    assert {option.opts[0] for option in options if option.hidden} == HIDDEN
    assert len([option for option in options if not option.hidden]) <= 250


def test_an_option_of_a_group_is_read_once_for_all_its_commands() -> None:
    for path, group in leaves(command_line()):
        for command in getattr(group, "commands", {}).values():
            shared, params = getattr(command, "shared", ()), command.params
            assert not {id(option) for option in shared} & {id(option) for option in params}, path
            assert {id(option) for option in shared} <= {
                id(it) for _, above in leaves(command_line()) for it in above.params
            }
    views = command_line().commands["show"].commands
    assert "--units" not in [text for option in views["curves"].params for text in option.opts]
    assert views["curves"].shared[1] is views["map"].shared[1]


@pytest.mark.parametrize(
    "words", [("--units", "rpm", "ID", "curves"), ("ID", "curves", "--units", "rpm"), ("--units=rpm", "curves", "ID")]
)
def test_an_option_of_a_group_stands_before_or_behind_its_command(words: tuple[str, ...]) -> None:
    root = command_line()
    show = cast("Any", root.commands["show"])
    # A command keeps the help option that it has first, whose names are those of its parent.
    parent = typer.Context(root, **root.context_settings)
    context = show.make_context("show", list(words), parent=parent, resilient_parsing=True)
    name, command, rest = show.resolve_command(context, [*context._protected_args, *context.args])
    inner = command.make_context(name, rest, parent=context)
    assert (name, inner.params["study"], inner.params["units"]) == ("curves", "ID", "rpm")


def test_the_value_of_an_option_is_no_command(sprag: Sprag, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = sprag("admin", "--db", "user", "user", "list")
    assert (done.code, f"{tmp_path / 'user'}: there is no database" in done.err) == (2, True), done.err
    refused = sprag("show", "--units", "rpm", "one_pendulum", "state")
    assert (refused.code, "No such option: --units" in refused.err) == (2, True), refused.err


def test_help_says_which_views_have_a_shared_option() -> None:
    show = command_line().commands["show"]
    titles = {name: title for title, name, _ in show.listed()}
    views: dict[str, set[str]] = {}
    for name, view in show.commands.items():
        for option in (*view.params, *view.shared):
            views.setdefault(option.name, set()).add("case" if name == "case" else titles[name])
    assert views["units"] == {"Of a study", "case"}
    assert views["db"] == {"Of a study", "Of one case (--case N)", "case"}
    assert views["by"] == views["at"] == {"Of a study"}
    assert views["case"] == {"Of one case (--case N)", "case"}
    assert views["start"] == {"Of one case (--case N)"}
    said = "--by and --at are of views with axes, --case and --start of one case."
    assert said in " ".join(show.help.split())


def test_help_loads_no_command() -> None:
    code = (
        "import sys; from sprag_study.service.cli.app import execute; execute(['--help']); "
        "print([name for name in sys.modules if name.startswith('sprag_study.service.cli.')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = done.stdout.splitlines()[-1]
    assert not [name for name in ("remote", "show", "study", "local", "admin") if f"cli.{name}'" in loaded], loaded


@pytest.mark.parametrize("old", OLD)
def test_every_old_name_is_forwarded_with_a_line_that_names_the_new_one(sprag: Sprag, old: str) -> None:
    words, new = forwarded([old])
    assert new == OLD[old]
    tree: Any = command_line()
    for word in words:
        tree = tree.commands[word]
    done = sprag(old, "--help")
    assert done.out == sprag(*words, "--help").out
    assert (done.code, done.err) == (0, f"`sprag {old}` is called `sprag {new}` from now on\n")
    assert sprag(old, "--nonsense", "--json").err.startswith('{"error"'), "programs read one JSON object"
    assert f"  {old} " not in sprag("--help").out


def test_old_names_keep_their_arguments() -> None:
    assert forwarded(["curve", "--x", "shaft.load", "st_1"])[0] == ["show", "curves", "--x", "shaft.load", "st_1"]
    assert forwarded(["db", "upgrade"])[0] == ["admin", "db", "upgrade"]
    assert forwarded(["case", "st_1", "4"])[0] == ["show", "case", "st_1", "--case", "4"]
    assert forwarded(["case", "st_1", "4", "trajectory", "--set", "from=6 periods", "-o", "a.csv"])[0] == [
        "show", "trajectory", "st_1", "--case", "4", "--from=6 periods", "-o", "a.csv",
    ]  # fmt: skip
    assert forwarded(["list", "curve"]) == (["list", "curve"], "")
    for old in (["admin", "db", "audit"], ["db", "audit"]):
        assert forwarded([*old, "--json"]) == (["admin", "audit", "--json"], "admin audit")
    for words in (["admin", "--db", "db", "db", "audit"], ["admin", "db", "--db", "db", "audit"]):
        assert forwarded(words) == (["admin", "audit", "--db", "db"], "admin audit")
    assert forwarded(["admin", "--db", "db", "audit"]) == (["admin", "--db", "db", "audit"], "")


def test_options_that_are_gone_are_forwarded_with_a_line(
    sprag: Sprag, examples: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("SPRAG_PROCESSES", raising=False)
    for count, code in (("3", 0), ("0.5", 2)):
        done = sprag("check", examples / "one_pendulum.json", "--processes", count)
        assert (done.code, "`--processes` is `SPRAG_PROCESSES` from now on\n" in done.err) == (code, True)
    assert "SPRAG_PROCESSES" not in os.environ
    assert without_gone(["admin", "worker", "--processes", "2"])[1] == {"SPRAG_PROCESSES": "2"}
    assert without_gone(["show", "a", "strobes", "--format=json"]) == (
        ["show", "a", "strobes", "--format=json"], {}, [("--format", "--json")],
    )  # fmt: skip
    for words in (["check", "a", "--processes"], ["run", "a", "--chunk", "0"], ["serve", "--chunk="]):
        assert without_gone(words)[:2] == (words, {})
        done = sprag(*words)
        assert (done.code, "No such option: --" in done.err) == (2, True), done.err
    assert without_gone(["export", "a", "--format", "csv"]) == (["export", "a", "--format", "csv"], {}, [])


def test_a_format_that_is_gone_is_that_of_the_file(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    words = ("show", examples / "one_pendulum.json", "trajectory", "--points", 2, "-o")
    line = {"csv": "`--format` is `-o FILE.csv` from now on", "json": "`--format` is `--json` from now on"}
    for name, form in (("m.txt", "csv"), ("m.csv", "json")):
        done = sprag(*words, tmp_path / name, "--format", form)
        assert (done.code, line[form] in done.err) == (0, True), done.err
        assert (tmp_path / name).read_text().startswith("{") == (form == "json")
    done = sprag(*words, tmp_path / "m.csv", "--format", "xml")
    assert (done.code, "'xml' is not one of 'csv', 'json'" in done.err) == (2, True), done.err


def test_a_misspelt_view_is_named_with_those_that_the_study_has(sprag: Sprag, examples: Path) -> None:
    done = sprag("show", examples / "one_pendulum.json", "crves")
    assert done.code == 2
    assert "WHAT: is no view; did you mean 'curves'? (got 'crves'; allowed: state, answers, curves" in done.err
    assert "transient" not in done.err
    assert "calibration" not in done.err
    assert "transient" in sprag("show", examples / "press.toml", "curvs").err


@pytest.mark.parametrize(
    ("view", "option"), [("basin", "--grid=10"), ("diagram", "--values=10"), ("branch", "--points=10")]
)
def test_settings_of_a_case_have_the_names_of_today(view: str, option: str) -> None:
    words, new = forwarded(["case", "st_1", "3", view, "--set", "points=10"])
    assert words == ["show", view, "st_1", "--case", "3", option]
    assert new == f"show ID {view} --case N"


def test_common_options_stand_anywhere() -> None:
    line = [
        "--language",
        "uk",
        "show",
        "st_1",
        "--json",
        "curves",
        "--language",
        "de",
        "--server=http://a",
        "--token",
        "x",
    ]
    assert common_first(line) == (
        ["--language", "uk", "--json", "--language", "de", "--server=http://a", "--token", "x"],
        ["show", "st_1", "curves"],
    )
    assert common_first(["list", "--", "--json"]) == ([], ["list", "--", "--json"])


@pytest.mark.parametrize("option", ["--token", "--server", "--language"])
def test_a_common_option_without_its_value_is_refused(sprag: Sprag, option: str) -> None:
    for line in (("list", option), (option,)):
        done = sprag(*line)
        assert (done.code, f"Option '{option}' requires an argument." in done.err) == (2, True), done.err


def test_what_is_no_number_is_called_so(sprag: Sprag) -> None:
    done = sprag("admin", "token", "create", "--name", "x", "--expires", "30 days")
    assert "Invalid value for '--expires': '30 days' is not a whole number." in done.err


def test_a_spec_is_a_preset_by_its_name(sprag: Sprag, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for words in (("check", "one_pendulum"), ("show", "one_pendulum")):
        assert "one_pendulum: valid, 512 cases" in sprag(*words).out
    monkeypatch.chdir(tmp_path)
    Path("one_pendulum").write_text("nothing")
    assert sprag("check", "one_pendulum").code == 2, "a file of that name is read"


def test_a_study_is_named_before_or_behind_the_view(sprag: Sprag, tmp_path: Path) -> None:
    spec = tmp_path / "absent.json"
    for words in (("show", spec, "curves"), ("show", "curves", spec), ("show", "curves", "--x", "a", spec)):
        done = sprag(*words)
        assert (done.code, f"{spec}: no such file" in done.err) == (2, True), words


@pytest.fixture
def login(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file of the login, in a folder of the test's own."""
    for name in ("SPRAG_SERVER", "SPRAG_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(typer, "get_app_dir", lambda name: str(tmp_path / "settings" / name))
    return login_file()


def test_a_login_keeps_address_and_token_for_its_service_only(
    sprag: Sprag, service: Service, login: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    secret, _ = service.store.people.create_token("laptop", TokenScope.WRITE)
    study = None
    with served(service.app) as address:
        assert sprag("login", address, "--token", "wrong").code == 3
        assert not login.exists(), "what the service refuses is not kept"
        assert sprag("login", address, "--token", secret).code == 0
        assert json.loads(login.read_text()) == {"server": address, "token": secret}
        if os.name == "posix":
            assert stat.S_IMODE(login.stat().st_mode) == 0o600
        study = sprag("list", "--json")
        assert study.code == 0, study.err
        monkeypatch.setenv("SPRAG_SERVER", "http://elsewhere.example")
        assert common.access()[:2] == ("http://elsewhere.example", None), "a token is sent to no other service"
        monkeypatch.delenv("SPRAG_SERVER")
        monkeypatch.setenv("SPRAG_TOKEN", "wrong")
        login.write_text(json.dumps({"server": address, "token": "revoked"}))
        refused = sprag("list").err
        assert "log in again with `sprag login`" in refused
        assert "The token is that of `sprag login`. SPRAG_TOKEN is not sent to the service of `sprag login`" in refused
        assert sprag("list", "--token", "no").err.count("SPRAG_TOKEN") == 0, "nothing is left out"
        monkeypatch.setenv("SPRAG_SERVER", address)
        refused = sprag("list").err
        assert "The token is that of SPRAG_TOKEN. The token of `sprag login` is for its service only" in refused
        monkeypatch.delenv("SPRAG_SERVER")
        assert "in SPRAG_TOKEN" in sprag("login", address).err, "which sends it"
        monkeypatch.delenv("SPRAG_TOKEN")
        assert sprag("logout").code == 0
        assert not login.exists()
        assert sprag("list").code == 3
    assert "there is no login" in sprag("logout").err


def test_a_fault_of_the_program_has_an_exit_code_of_its_own(
    sprag: Sprag, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from sprag_study.service.cli import app

    def wrong() -> None:
        raise RuntimeError

    monkeypatch.setattr("sprag_study.service.cli.settings.read_settings", wrong)
    assert app.execute(["settings"]) == 1
    assert "This is a bug in Sprag" in capsys.readouterr().err


def test_findings_are_printed_as_they_come(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    printed = []

    def examine(_db: str | None) -> Iterator[doctor.Finding]:
        yield doctor.Finding("first", True, "fine")
        printed.append(capsys.readouterr().out)
        yield doctor.Finding("second", True, "fine too")

    monkeypatch.setattr(doctor, "examine", examine)
    doctor.doctor()
    assert printed == ["   ok  first: fine\n"]


def test_components_are_listed_with_their_units(
    sprag: Sprag, service: Service, connected: Callable[[Any], None]
) -> None:
    connected(components)
    fields = {"coefficients": "0; 200", "backlash": "0.3 deg", "windup_limit": "0.1"}
    body = {"components": [{"kind": "clutch", "name": "FW 20", "fields": fields}]}
    assert service.http.post("/api/v1/components", json=body).status_code in (200, 201)
    shown = sprag("component", "list").out
    assert "windup_limit 0.1 rad" in shown
    assert "backlash 0.3°" in shown or "backlash 0.3 deg" in shown


def test_the_secret_of_this_machine_is_not_sent_to_the_service_of_a_login(
    login: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("SPRAG_SERVER", raising=False)
    monkeypatch.setenv("SPRAG_TOKEN", "a-secret-of-this-machine")
    login.parent.mkdir(parents=True)
    for kept, sent in (({}, ""), ({"token": "kept"}, "kept")):
        login.write_text(json.dumps({"server": "http://far.example", **kept}))
        assert common.access()[:2] == ("http://far.example", sent)
        given = access_of("http://far.example/", None).token
        assert given == (sent or "a-secret-of-this-machine"), "as to every address that is given"
    monkeypatch.setenv("SPRAG_SERVER", "http://near.example")
    assert common.access()[:2] == ("http://near.example", "a-secret-of-this-machine")
    with Client("http://far.example", "") as client:
        assert "authorization" not in client._http.headers


def test_the_doctor_says_which_token_is_sent(login: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sound = doctor._access()
    assert sound == (True, f"{DEFAULT_SERVER} No token is sent.")
    monkeypatch.setenv("SPRAG_TOKEN", "a-secret-of-this-machine")
    login.parent.mkdir(parents=True)
    login.write_text(json.dumps({"server": "http://anna:very-secret@far.example"}))
    sound, text = doctor._access()
    assert (sound, "very-secret" in text) == (True, False)
    assert text.startswith("http://far.example No token is sent. SPRAG_TOKEN is not sent to the service of")


def test_no_command_shows_the_password_of_an_address(
    sprag: Sprag, login: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = "http://anna:very-secret@far.example"
    asked = nullcontext(SimpleNamespace(me=lambda: {"user": "anna"}))
    monkeypatch.setattr("sprag_study.service.cli.login.served_by", lambda *_: asked)
    monkeypatch.setenv("SPRAG_TOKEN", "a-secret-of-this-machine")
    for line in (["login", address], ["login", address, "--json"], ["settings"], ["settings", "--json"]):
        done = sprag(*line)
        assert (done.code, "far.example" in done.out + done.err) == (0, True), (line, done.err)
        assert "very-secret" not in done.out + done.err, line
    assert json.loads(login.read_text())["server"] == address
    monkeypatch.setenv("SPRAG_SERVER", address)
    assert "very-secret" not in sprag("settings").out


def test_an_address_that_is_none_is_refused(sprag: Sprag, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPRAG_SERVER", "http://[::1")
    done = sprag("list", "--json")
    assert (done.code, done.failure["code"]) == (2, "invalid-parameter")


def test_a_damaged_login_is_none(login: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    login.parent.mkdir(parents=True)
    login.write_text("not JSON")
    assert common.access()[:2] == (DEFAULT_SERVER, None)


def test_a_view_of_a_service_is_asked_for_without_the_models() -> None:
    code = (
        "import sys; sys.stdout.isatty = lambda: True\n"
        "from sprag_study.service.cli.app import execute\n"
        "from sprag_study.service.cli.remote import read_in\n"
        "with read_in(None, 'st_1', None): pass\n"
        "assert execute(['show', 'st_1', 'curves', '--server', 'http://127.0.0.1:1']) == 3\n"
        "print([name for name in ('numba', 'scipy', 'sqlalchemy', 'sprag_study.engine') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n", done.stderr
