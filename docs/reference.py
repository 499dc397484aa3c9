"""Tables of reference, HTTP interface, faults and theory, and the manual pages, from what the program says of itself.

The sentences between the tables are by hand.

python -m docs.reference           write tables and pages anew
python -m docs.reference --check   exit code 1 where one of them is not what the program says
"""

from __future__ import annotations

import re
import sys
from collections.abc import Container, Iterable, Iterator
from pathlib import Path

from fastapi.routing import APIRoute

from docs import manual
from sprag_study.engine.formulas.expressions import MAX_LENGTH
from sprag_study.engine.vibration_drive.examined import MAX_PERIODS
from sprag_study.engine.vibration_drive.force_results import force_infos
from sprag_study.engine.vibration_drive.load_results import load_infos
from sprag_study.engine.vibration_drive.ramps import start_up_infos
from sprag_study.service.cli.app import command_line
from sprag_study.service.cli.console import ExitCode
from sprag_study.service.cli.settings import VARIABLES
from sprag_study.service.fault_meanings import KIND_MEANINGS, MEANINGS, WARNING_MEANINGS
from sprag_study.service.http.app import ROUTED
from sprag_study.service.http.problems import PROBLEM_TYPES
from sprag_study.service.settings import table
from sprag_study.worker import limits as limit
from sprag_study.worker import models
from sprag_study.worker.models import machine_shaft
from sprag_study.worker.models.parameters import general_path
from sprag_study.worker.states import StudyState

FOLDER = Path(__file__).parent
Row = Iterable[str]


def commands(command: object | None = None, name: str = "") -> Iterator[Row]:
    """Every command with the first paragraph of its help."""
    command = command or command_line()
    if name and (not hasattr(command, "commands") or getattr(command, "invoke_without_command", False)):
        yield f"`sprag {name}`", _sentence(command.help)  # type: ignore[attr-defined]
    for key, inner in getattr(command, "commands", {}).items():
        yield from commands(inner, f"{name} {key}".strip())


def _sentence(text: str) -> str:
    """The first paragraph, its options as code."""
    return re.sub(
        r"(`[^`]*`)|(--[a-z-]+)", lambda found: found[1] or f"`{found[2]}`", " ".join(text.partition("\n\n")[0].split())
    )


def operations() -> Iterator[Row]:
    """Every operation of the HTTP interface with its description."""
    for module in ROUTED:
        for route in module.router.routes:
            if isinstance(route, APIRoute) and route.include_in_schema:
                for method in sorted(route.methods):
                    yield method, f"`{route.path_format}`", " ".join(route.description.split())


def settings() -> Iterator[Row]:
    """Every setting."""
    return ((f"`{row.variable}`", f"`{row.default}`" if row.default else "", row.help) for row in table())


def variables() -> Iterator[Row]:
    """Every variable of commands."""
    return ((f"`{name}`", sentence) for name, sentence in VARIABLES.items())


def parameters(model: str) -> Iterator[Row]:
    """Every parameter of a model."""
    for entry in models.parameter_catalogue(model):
        default = "" if entry.default is None else f"{entry.default:g}"
        yield f"`{entry.path}`", entry.unit, entry.range_text(), default, entry.help


def results(model: str, besides: Container[str] | None = None) -> Iterator[Row]:
    """Every result of a model that all cases have; or those that some cases have ``besides``."""
    for info in models.result_catalogue(model):
        if (
            info.name not in {*SETTLED_ONLY, *STARTS_ONLY, *LOADS, *SHAFT_LOADS}
            if besides is None
            else info.name in besides
        ):
            yield f"`{info.name}`", info.unit, info.description


def forces() -> Iterator[Row]:
    """Every result of the forces of a case."""
    for info in force_infos(1):
        yield f"`{info.name.replace('pendulums.0.', 'pendulums.N.')}`", info.unit, info.description


def start_ups() -> Iterator[Row]:
    """Every result of the start-up of a case."""
    for info in start_up_infos(1):
        yield f"`{info.name.replace('pendulums.0.', 'pendulums.N.')}`", info.unit, info.description


def meanings(sentences: dict[str, str]) -> Iterator[Row]:
    """Names with their sentences."""
    return ((f"`{name}`", sentence) for name, sentence in sentences.items())


def limits() -> Iterator[Row]:
    """What a study and a service are held to."""
    yield "axes of a study", f"{limit.MAX_AXES:,}"
    yield "columns of a table of cases", f"{limit.MAX_COLUMNS:,}"
    yield "derived parameters of a study", f"{limit.MAX_DERIVED:,}"
    yield "quantities of a study, characters of a name", f"{limit.MAX_QUANTITIES:,}, {limit.MAX_QUANTITY_NAME:,}"
    yield "tolerances of a study, drawn drives", f"{limit.MAX_TOLERANCES:,}, {limit.MAX_DRIVES:,}"
    yield "fresh drives of the best designs of a search", f"{limit.MAX_FRESH_DRIVES:,}"
    yield "starts of a case, initial values that differ", f"2 to {limit.MAX_STARTS:,}, {limit.MAX_START_RANGES}"
    yield "cases of a study", f"{limit.MAX_CASES:,}"
    yield "values on all axes together", f"{limit.MAX_AXIS_VALUES:,}"
    yield "size of a spec", f"{limit.MAX_BODY_BYTES:,} bytes"
    yield "nesting of a spec", f"{limit.MAX_DEPTH} levels"
    yield "pendulums of a drive", f"{models.MAX_PENDULUMS}"
    yield "coefficients of a clutch law", f"{models.MAX_COEFFICIENTS}"
    yield "rows of measured clutch data", f"{limit.MAX_CLUTCH_ROWS:,}"
    yield "steps of an operation, constants of formulas", f"{machine_shaft.MAX_STEPS}"
    yield "stages of a drive train", f"{machine_shaft.MAX_STAGES}"
    yield "joints of a machine with loads among its results", f"{machine_shaft.MAX_JOINTS}"
    yield "rows of a table of a machine", f"{machine_shaft.MAX_ROWS:,}"
    yield "characters of a formula", f"{MAX_LENGTH:,}"
    yield "excitation periods of a run", f"{limit.MAX_RUN_PERIODS:,.0f}"
    searched = f"{limit.MIN_SETTLED_PERIODS:,} to {limit.MAX_SETTLED_PERIODS:,}"
    yield "excitation periods of a search for the settled motion (`at_most`)", searched
    yield "largest order of a periodic motion (`max_period`)", f"1 to {limit.MAX_ORBIT_PERIODS}"
    yield "scaled distance that counts as settled (`settled`)", f"{limit.MIN_SETTLED:g} to {limit.MAX_SETTLED:g}"
    smaller = f"{limit.MIN_NARROW_STEPS:,} to {limit.MAX_NARROW_STEPS:,}"
    yield "smaller steps into which a step of a sweep is split (`narrow`)", smaller
    yield "tolerance", f"{limit.MIN_TOLERANCE:g} to {limit.MAX_TOLERANCE:g}"
    yield "cases of a study of a selection (`select`)", f"{limit.MAX_POINTS_SELECTED:,}"
    yield "times of a trajectory", f"{limit.MAX_TRAJECTORY_POINTS:,}"
    told = "excitation periods in the tables of a case's engagements, and of which it has forces: the last of its run"
    yield told, f"{MAX_PERIODS}"
    yield "studies that have not ended", f"{limit.MAX_WAITING_STUDIES:,}"
    yield "schedules", f"{limit.MAX_SCHEDULES:,}"
    yield (
        "streams of events, and those of one token, where tokens are needed",
        f"{limit.MAX_STREAMS}, {limit.MAX_STREAMS_EACH}",
    )
    yield "checks, fits and pictures of one token, of all together", f"{limit.MAX_CHECKS_EACH}, {limit.MAX_CHECKS}"
    together = f"{limit.MAX_COMPUTATIONS_EACH}, {limit.MAX_COMPUTATIONS}"
    yield "instantaneous values asked for by one token, by all together", together
    yield "memory for the instantaneous values of a case", f"{limit.COMPUTATION_BYTES / 2**30:g} GiB"
    yield (
        "files of rows that are written or wait, of one token, of all together",
        f"{limit.MAX_FILES_EACH}, {limit.MAX_FILES}",
    )
    yield (
        "processor time, memory for a file of rows",
        f"{limit.FILE_SECONDS / 3600:g} h, {limit.FILE_BYTES / 2**30:g} GiB",
    )
    yield (
        "processes for them, of which may send rows while they are read",
        f"{limit.FILE_PROCESSES}, {limit.SENDING_PROCESSES}",
    )
    yield "time in which a file gets its turn, and then a process", f"{limit.FILE_WAIT_SECONDS:g} s each"
    yield (
        "time in which a client takes a piece of the rows that are sent while they are read",
        f"{limit.PIECE_SECONDS:g} s",
    )
    yield "time in which a change gets a thread, and then the write lock", f"{limit.LOCK_SECONDS:g} s each"
    yield "connections", f"{limit.MAX_CONNECTIONS}"
    yield "requests in progress of one token, where tokens are needed", f"{limit.MAX_REQUESTS_EACH}"
    yield "head, body of a request", f"{limit.HEAD_SECONDS:g} s, {limit.BODY_SECONDS:g} s"
    yield "time in which a client takes something of an answer", f"{limit.WRITE_SECONDS:g} s"


DRIVE = models.VIBRATION_DRIVE
WORDS = {name: name.replace("-", " ") for name in models.model_names()}
PARAMETER_HEADS = "path | unit | allowed | default | "
TIMED, SETTLED = (
    {info.name.replace("pendulums.0.", "pendulums.N.") for info in models.result_infos(DRIVE, variant)}
    for variant in ("1", "1-settled")
)
#: Endings of cases of the drive that come from the engine.
DRIVE_ENDINGS = {k: v for k, v in models.endings_of(DRIVE).items() if k not in set(models.WorkerEnding)}
_OF_ONE = {general_path(info.name) for info in load_infos(1)}
#: Results of studies with forces and duty, those that cases of a given time have not, and those of cases with starts
#: only.
LOADS = {info.name for info in models.result_catalogue(DRIVE) if general_path(info.name) in _OF_ONE}
SETTLED_ONLY = SETTLED - TIMED
#: Results of machine shafts that only studies with loads have.
SHAFT_LOADS = {info.name for info in models.result_catalogue(models.MACHINE_SHAFT)} - {
    info.name for info in models.result_infos(models.MACHINE_SHAFT, "")
}
STARTS_ONLY = {info.name for info in models.result_catalogue(DRIVE)} - SETTLED - LOADS
#: Name of a table, as the page has it in a comment above -> heads of its columns, and its rows.
TABLES: dict[str, tuple[str, Iterable[Row]]] = {
    "commands": ("command | ", commands()),
    "exit codes": ("exit code | meaning ", ((str(int(code)), code.sentence) for code in ExitCode)),
    "settings": ("variable | default | ", settings()),
    "variables": ("variable of commands | ", variables()),
    **{f"parameters of the {WORDS[name]}": (PARAMETER_HEADS, parameters(name)) for name in models.model_names()},
    **{f"results of the {WORDS[name]}": ("result | unit | ", results(name)) for name in models.model_names()},
    "results of settled cases": ("result | unit | meaning ", results(DRIVE, SETTLED_ONLY)),
    "results of cases with starts": ("result | unit | meaning ", results(DRIVE, STARTS_ONLY)),
    "results of cases with forces and duty": ("result | unit | meaning ", results(DRIVE, LOADS)),
    "results of machine shafts with loads": ("result | unit | meaning ", results(models.MACHINE_SHAFT, SHAFT_LOADS)),
    "forces of a case": ("result | unit | meaning ", forces()),
    "start-up of a case": ("result | unit | meaning ", start_ups()),
    "regimes": ("regime | meaning ", meanings(models.REGIME_SENTENCES)),
    "endings": ("ending | ", meanings(dict(models.ENDING_SENTENCES))),
    "flags": ("flag | ", meanings({k: v for name in models.model_names() for k, v in models.flags_of(name).items()})),
    "states": ("state | ", meanings({state.value: state.sentence for state in StudyState})),
    "limits": (" | ", limits()),
}


#: The tables of each page.
PAGES: dict[str, dict[str, tuple[str, Iterable[Row]]]] = {
    "reference.md": TABLES,
    "http.md": {
        "operations": ("method | address | ", operations()),
        "problems": (
            "type | status | title | ",
            ((f"`{kind.uri}`", str(kind.status), kind.title, kind.help) for kind in PROBLEM_TYPES.values()),
        ),
    },
    "faults.md": {
        "codes of faults": ("code | meaning ", meanings({**MEANINGS})),
        "kinds of faults": ("code | meaning ", meanings({**KIND_MEANINGS})),
        "codes of warnings": ("code | meaning ", meanings({**WARNING_MEANINGS})),
    },
    "theory.md": {
        "endings of the vibration drive": ("ending | meaning ", meanings(DRIVE_ENDINGS)),
    },
}


def page(text: str, tables: dict[str, tuple[str, Iterable[Row]]]) -> str:
    """The text of a page with its tables made anew."""
    for name, (heads, rows) in tables.items():
        lines = [f"| {heads}|".replace("|  |", "| |"), "|" + "---|" * (heads.count("|") + 1)]
        lines += [f"| {' | '.join(cells)} |" for cells in rows]
        pattern = rf"(<!-- table: {name} -->\n\n)(?:\|.*\n)*"
        made = "\n".join(lines) + "\n"
        text, found = re.subn(pattern, lambda match, made=made: match[1] + made, text)  # type: ignore[misc]
        if found != 1:
            raise ValueError(f"the page has {found} places for the table {name!r}")
    return text


def main() -> int:
    """Write the pages, or check them."""
    made = {FOLDER / name: page((FOLDER / name).read_text(encoding="utf-8"), tables) for name, tables in PAGES.items()}
    made |= {manual.FOLDER / name: text for name, text in manual.pages().items()}
    kept = {file: file.read_text(encoding="utf-8") for file in [*made, *manual.FOLDER.glob("*.1")] if file.exists()}
    if "--check" not in sys.argv:
        for file in kept.keys() - made.keys():
            file.unlink()
        for file, text in made.items():
            file.write_text(text, encoding="utf-8")
        return 0
    changed = {file for file in made.keys() | kept.keys() if made.get(file) != kept.get(file)}
    for file in sorted(changed):
        name = f"docs/{file.relative_to(FOLDER)}"
        lines = set(kept.get(file, "").splitlines())
        for line in made.get(file, "").splitlines():
            if line not in lines:
                print(f"{name} lacks: {line}")
        print(f"{name} is not what the program says: python -m docs.reference writes it anew.")
    return int(bool(changed))


if __name__ == "__main__":
    raise SystemExit(main())
