"""The documentation names what the program has, and nothing that it has not."""

import ast
import re
import subprocess
import tomllib
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement

from sprag_study.engine.machine_shaft.results import MACHINE_RESULTS
from sprag_study.engine.vibration_drive.force_results import force_infos
from sprag_study.engine.vibration_drive.ramps import start_up_infos
from sprag_study.engine.vibration_drive.regimes import settled_infos
from sprag_study.service.cli.app import command_line
from sprag_study.service.cli.old_words import GONE, OLD
from sprag_study.service.presets import ABOUT, preset_names, preset_text
from sprag_study.worker import models
from sprag_study.worker.codes import ENDING_CODES, FLAG_MASKS
from sprag_study.worker.states import StudyState

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]


def commands() -> dict[str, set[str]]:
    """Every command and group, such as "admin db upgrade" and "admin db", and its options."""
    root: Any = command_line("en")
    common = {
        option for parameter in root.params if not getattr(parameter, "hidden", False) for option in parameter.opts
    }
    found: dict[str, set[str]] = {}

    def collect(command: Any, path: tuple[str, ...]) -> set[str]:
        known = (*command.params, *getattr(command, "shared", ()))
        options = {option for parameter in known for option in parameter.opts} | common
        options -= {option for name, option in GONE if name in path[:1]}  # still read, but no page may have them
        for key, inner in getattr(command, "commands", {}).items():
            options |= collect(inner, (*path, key))
        found[" ".join(path)] = options
        return options

    collect(root, ())
    return found


def mentioned(text: str) -> Iterator[tuple[str, list[str]]]:
    """Every ``sprag ...`` of a page with the options that follow it on its line."""
    text = text.replace("\\\n", " ")
    for match in re.finditer(r"(?:^|[`$/ ])sprag (?:--server \S+ )?([a-z]+\b[^`\n]*)", text):
        line = match[0]
        if "`" in line or match.string[match.start()] in "$/" or _in_code(text, match.start()):
            typed = re.split(r"[#|]", match[1])[0]
            yield named(typed.split()), re.findall(r"(?<![\w-])(--?[a-z][a-z-]*)", typed)


def named(words: list[str]) -> str:
    """The command of a line: a view of `show` stands behind the study or before it."""
    tree: Any = command_line("en")
    path: list[str] = []
    while words and hasattr(tree, "commands"):
        known = [word for word in (words if path == ["show"] else words[:1]) if word.strip(",.") in tree.commands]
        if not known:
            break
        path.append(known[0].strip(",."))
        words.remove(known[0])
        tree = tree.commands[path[-1]]
    of_group = path and hasattr(tree, "commands") and words and words[0].islower()
    assert not of_group, f"sprag {' '.join([*path, *words])}"
    return " ".join(path) or words[0]


def _in_code(text: str, position: int) -> bool:
    return text.count("```", 0, position) % 2 == 1


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_command_and_option_of_the_pages_exists(page: Path) -> None:
    known = commands()
    history = page.name == "CHANGELOG.md" or page.parent.name == "adr"
    for name, options in mentioned(page.read_text()):
        if history and name in OLD:
            continue
        assert name in known, f"{page.name}: sprag {name}"
        for option in options:
            if history and (name.split()[0], option) in GONE:
                continue
            assert option in known[name], f"{page.name}: sprag {name} {option}"


def test_the_pages_mention_commands() -> None:
    found = {name for page in PAGES for name, _ in mentioned(page.read_text())}
    assert {"run", "serve", "fit", "admin db upgrade", "show curves"} <= found


def test_python_of_the_pages_can_be_read() -> None:
    blocks = [block for page in PAGES for block in re.findall(r"(?ms)^```python\n(.*?)^```", page.read_text("utf-8"))]
    assert len(blocks) > 3
    for block in blocks:
        ast.parse(block)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        file, _, anchor = target.partition("#")
        if "://" in file:
            continue
        path = page.parent / file if file else page
        assert path.exists(), f"{page.name}: {target}"
        if anchor:
            headings = re.findall(r"^#+ (.+)$", path.read_text(), re.MULTILINE)
            assert anchor in {re.sub(r"[^\w-]", "", h.lower().replace(" ", "-")) for h in headings}, target


def test_results_that_the_pages_name_exist() -> None:
    names = {info.name for info in (*settled_infos(8), *force_infos(8), *start_up_infos(8), *MACHINE_RESULTS)}
    names |= {re.sub(r"\d", "N", name) for name in names}
    pattern = r"\b((?:shaft|torque|power|fraction|balance|reset|runup|clutches)\.(?!md\b)[a-z_]+(?:\.[a-z_]+)*)\b"
    # With the objects whose rows have numbers.
    paths = {place for entry in models.parameter_catalogue("vibration-drive") for place in entry.path.split(".K.")[:1]}
    paths |= {entry.path for entry in models.parameter_catalogue("vibration-drive")}
    for page in PAGES:
        for name in re.findall(pattern, page.read_text()):
            # A page may name a family of results, or leave out the pendulum that a table's heading names.
            family = any(known.startswith(f"{name}.") or known.endswith(f".{name}") for known in names)
            assert name in names | paths or family, f"{page.name}: {name}"


def test_the_page_of_exports_has_the_number_of_every_ending_and_flag() -> None:
    page = (ROOT / "docs" / "exports.md").read_text()
    told = {name: int(number) for name, number in re.findall(r"\| `(\w+)`(?: \(not run\))? \| (-?\d+) ", page)}
    assert told == {**ENDING_CODES, **FLAG_MASKS}


def test_the_studies_that_come_with_the_program_are_the_examples() -> None:
    for name in preset_names():
        file, text = preset_text(name)
        assert (ROOT / "examples" / file).read_text() == text


def test_the_presets_are_described_with_their_sources() -> None:
    page = (ROOT / "docs" / "presets.md").read_text()
    for name, about in ABOUT.items():
        (row,) = [line for line in page.splitlines() if line.startswith(f"| `{name}` |")]
        assert row.endswith(f"| {about.shows} | {about.values} |")


def test_the_waiting_loop_of_the_first_study_ends_in_every_state_that_a_study_does_not_leave_by_itself() -> None:
    (pattern,) = re.findall(r"grep -qE '(.+?)'", (ROOT / "docs" / "first-study.md").read_text())
    for state in StudyState:
        stays = state.terminal or state is StudyState.PAUSED
        assert (re.search(pattern, f'{{"id":"x","state":"{state}","model":"m"}}') is not None) is stays, state


#: What benchmarks and pages compare Sprag with, and nothing of it imports.
PEERS = {"adaptive", "cmaes", "optuna", "pymoo"}
TEXTS = {".cfg", ".css", ".html", ".ipynb", ".js", ".json", ".md", ".po", ".py", ".toml", ".typ", ".yaml"}


def texts() -> Iterator[tuple[str, str]]:
    """Every text of the repository that somebody reads or runs, by its name."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        path = ROOT / name
        wanted = path.suffix in TEXTS or path.name in {"Containerfile", "Makefile"}
        if wanted and path.is_file() and not name.startswith("tests/"):
            yield name, path.read_text("utf-8")


def installed_by(text: str) -> Iterator[str]:
    """What the commands of a text install, without options, files and folders."""
    for command in re.findall(r"pipx? install((?: +(?:\\?['\"][^'\"\n]+['\"]|[\w.\[=@{-][^\s`'\")]*))+)", text):
        for word in re.findall(r"[^\s'\"\\]+", command):
            if not word.startswith(("-", ".", "$")) and not re.search(r"\.whl|\.txt|/", word):
                yield word.rstrip(".,:;")


def test_no_text_has_foreign_distributions_installed() -> None:
    """On the index others have taken short names, `sprag` among them."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = project["optional-dependencies"]
    needed = [*project["dependencies"], *(name for extra in extras.values() for name in extra)]
    known = {Requirement(name).name for name in needed} | PEERS
    seen = 0
    for name, text in texts():
        old = name == "CHANGELOG.md"  # its earlier releases tell what they were
        for word in installed_by(text.partition("\n## 0.9.0")[0] if old else text):
            seen += 1
            if word == "sprag-study[{extra}]":  # service/extras.py
                continue
            requirement = Requirement(word.replace("NN", "1"))
            assert requirement.name in known, f"{name}: {word}"
            of_program = name.startswith(("service/", "worker/", "sprag_study/"))  # installed where it says so
            assert old or of_program or requirement.name != project["name"], f"{name}: {word} is on no index"
            assert requirement.name != project["name"] or requirement.extras <= set(extras), f"{name}: {word}"
        if not old:
            assert not re.search(r"\b(?:import|from) sprag\b|python3? -m sprag\b|sprag\[[a-z]", text), name
    assert seen > 10


def test_every_page_installs_the_wheel_that_the_first_page_names() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    wheel = f"SPRAG=dist/sprag_study-{project['version']}-py3-none-any.whl\n"
    assert wheel in (ROOT / "README.md").read_text("utf-8")
    extras = []
    for name, text in texts():
        extras += re.findall(r"pip install [^`\n]*\$\{SPRAG\}\[([\w,]+)\]", text)
        assert name.startswith("CHANGELOG") or not re.search(r"pip install [^`\n]*sprag_study-", text), name
    assert {one for extra in extras for one in extra.split(",")} <= set(project["optional-dependencies"])
    assert len(extras) > 8


def test_a_foreign_distribution_is_noticed() -> None:
    assert list(installed_by("run `pip install sprag`, or pip install -U 'sprag[server]' \"numba==0.1\"")) == [
        "sprag",
        "sprag[server]",
        "numba==0.1",
    ]


def test_benchmarks_are_called_as_modules() -> None:
    for page in [*PAGES, *(ROOT / "benchmarks").rglob("*.py")]:
        assert not re.search(r"python benchmarks/", page.read_text()), page


def test_each_decision_has_a_number_of_its_own() -> None:
    numbers = [path.name[:4] for path in (ROOT / "docs" / "adr").glob("[0-9]*.md")]
    assert sorted(set(numbers)) == sorted(numbers)
    for path in (ROOT / "docs" / "adr").glob("[0-9]*.md"):
        assert path.read_text(encoding="utf-8").startswith(f"# {path.name[:4]}. "), path.name


def test_the_newest_version_of_the_change_log_is_that_of_the_project() -> None:
    headings = re.findall(r"(?m)^## (.+)$", (ROOT / "CHANGELOG.md").read_text("utf-8"))
    assert headings[0] == "Unreleased"
    releases = [re.fullmatch(r"(\d+)\.(\d+)\.(\d+) \((\d{4}-\d\d-\d\d)\)", heading) for heading in headings[1:]]
    assert None not in releases, headings
    versions = [
        (tuple(map(int, release.groups()[:3])), date.fromisoformat(release[4])) for release in releases if release
    ]
    assert versions == sorted(versions, reverse=True)
    assert len({version for version, _ in versions}) == len(versions)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert ".".join(map(str, versions[0][0])) == project["version"]
