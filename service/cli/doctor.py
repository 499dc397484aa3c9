"""``sprag doctor``: checks of the installation."""

from __future__ import annotations

import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from datetime import UTC, datetime, timedelta
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer

from sprag.service.cli.console import ExitCode, WrongInputError, console, write_json, write_text
from sprag.service.cli.options import Database, JsonFlag
from sprag.service.cli.settings import read_settings
from sprag.service.faults import Fault
from sprag.worker.limits import MAX_TOLERANCE, MIN_TOLERANCE

_LIBRARIES = ("numpy", "scipy", "numba", "llvmlite", "sqlalchemy", "fastapi", "uvicorn")
#: Default shape of the kernel to print.
_KERNEL = {"pendulums": 1, "coefficients": 4, "tolerance": 1e-9}
#: Backups are made every night.
_OLD_BACKUP = timedelta(hours=49)
#: A study of a million cases of one pendulum takes about half of this.
_LEAST_FREE_BYTES = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of one check. ``ok`` False means that the user must act."""

    subject: str
    ok: bool
    detail: str


def doctor(
    db: Database = None,
    kernel: Annotated[bool, typer.Option("--kernel", help="Print the generated source of a kernel instead.")] = False,
    pendulums: Annotated[int | None, typer.Option(min=1, help="Pendulums of that kernel; default: 1.")] = None,
    coefficients: Annotated[int | None, typer.Option(min=1, help="Its clutch coefficients; default: 4.")] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(min=MIN_TOLERANCE, max=MAX_TOLERANCE, help="Tolerance it is for; default: 1e-9."),
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """Check versions, database, permissions, disk, backups, kernels and known values; exit code 3 on any problem."""
    shape = {"pendulums": pendulums, "coefficients": coefficients, "tolerance": tolerance}
    given = {name: value for name, value in shape.items() if value is not None}
    if kernel:
        _show_kernel(_KERNEL | given, as_json)
        return
    if given:
        problems = [
            Fault(f"--{name}", "not-used", "belongs to --kernel, which is not given", value)
            for name, value in given.items()
        ]
        raise WrongInputError("invalid-parameter", "invalid option", problems)
    findings = list(examine(db))
    sound = all(finding.ok for finding in findings)
    if as_json:
        write_json({"sound": sound, "findings": [asdict(finding) for finding in findings]})
    else:
        screen = console()
        for finding in findings:
            mark, style = ("ok", "green") if finding.ok else ("WRONG", "bold red")
            screen.print(f"{mark:>5}", style=style, end="  ")
            screen.print(f"{finding.subject}: {finding.detail}", markup=False, soft_wrap=True)
    if not sound:
        raise typer.Exit(ExitCode.TROUBLE)


def _show_kernel(shape: dict[str, Any], as_json: bool) -> None:
    from sprag.worker.models import MAX_COEFFICIENTS, MAX_PENDULUMS, kernel_source

    for name, most in (("pendulums", MAX_PENDULUMS), ("coefficients", MAX_COEFFICIENTS)):
        if shape[name] > most:
            problem = Fault(f"--{name}", "unknown-name", "is out of range", shape[name], allowed=f"1 .. {most}")
            raise WrongInputError("invalid-parameter", "invalid option", [problem])
    text = kernel_source(**shape)
    if as_json:
        write_json({**shape, "source": text})
    else:
        write_text(text)


def examine(db: str | None) -> Iterator[Finding]:
    """Run all checks, with one finding each; a check that fails itself is a finding too."""
    for subject, look in _checks(db).items():
        try:
            ok, detail = look()
        except Exception as error:  # the other checks continue, whatever is broken
            ok, detail = False, f"{type(error).__name__}: {error}"
        yield Finding(subject, ok, detail)


def _checks(db: str | None) -> dict[str, Callable[[], tuple[bool, str]]]:
    url = read_settings(database=db).database_url
    file = Path(url.removeprefix("sqlite:///")) if url.startswith("sqlite") else None
    here: dict[str, Callable[[], tuple[bool, str]]] = {}
    if file is not None:
        here = {"SQLite": _sqlite, "rights": lambda: _rights(file), "disk": lambda: _disk(file), "backups": _backups}
    return {
        "versions": _versions,
        "database": lambda: _database(url, file),
        "clock": lambda: _clock(url, file),
        **here,
        "kernel cache": _cache,
        "engine": _known_values,
    }


def _versions() -> tuple[bool, str]:
    libraries = ", ".join(f"{name} {version(name)}" for name in _LIBRARIES)
    text = f"Sprag {version('sprag')}, Python {platform.python_version()} on {platform.system()} {platform.machine()}"
    return sys.version_info >= (3, 11), f"{text}, {libraries}"


def _sqlite() -> tuple[bool, str]:
    from sprag.service.storage.sqlite_files import sqlite_version, sqlite_warning

    warning = sqlite_warning()
    return warning is None, warning or ".".join(map(str, sqlite_version()))


def _database(url: str, file: Path | None) -> tuple[bool, str]:
    from sprag.service.storage.maintenance import revision
    from sprag.service.storage.session import Session
    from sprag.service.storage.tables import HEAD_REVISION

    if file is not None and not file.exists():
        return True, f"{file} (not created yet)"
    session = Session(url)
    try:
        found, location = revision(session), session.location
    finally:
        session.close()
    if found not in (None, HEAD_REVISION):
        return False, f"{location} has revision {found}, this program needs {HEAD_REVISION}: run `sprag db upgrade`"
    return True, f"{location}, revision {found or 'none yet'}"


def _rights(file: Path) -> tuple[bool, str]:
    """Whether the database and its backups are private; earlier versions created them readable by everybody."""
    from sprag.service.jobs.maintenance import backups
    from sprag.service.storage.private_files import readable_by_others

    folder = read_settings().backup_folder
    copies = [path for _, path in backups(Path(folder).expanduser())] if folder else []
    beside = [file.with_name(f"{file.name}{suffix}") for suffix in ("", "-wal", "-shm", ".lock", ".reserve")]
    shared = [str(path) for path in (*beside, *copies) if path.exists() and readable_by_others(path)]
    if shared:
        return False, f"others can read {', '.join(shared)}: `chmod 600` keeps digests of tokens and designs private"
    return True, "only their owner can read database and backups"


def _clock(url: str, file: Path | None) -> tuple[bool, str]:
    from sprag.service.storage.clock_watch import clock_problem
    from sprag.service.storage.store import Store

    now = f"it is {datetime.now(UTC).isoformat(timespec='seconds')}"
    if file is not None and not file.exists():
        return True, now
    with Store.open(url) as store:
        problem = clock_problem(store)
    return problem is None, problem or now


def _disk(location: Path) -> tuple[bool, str]:
    folder = next(parent for parent in location.absolute().parents if parent.exists())
    free = shutil.disk_usage(folder).free
    return free >= _LEAST_FREE_BYTES, f"{free / 1e9:.3g} GB free at {folder}"


def _backups() -> tuple[bool, str]:
    from sprag.service.jobs.maintenance import backups

    folder = read_settings().backup_folder
    if not folder:
        return True, "no backups are made (SPRAG_BACKUP_FOLDER is not set)"
    found = backups(Path(folder).expanduser())
    if not found:
        return False, f"there is none in {folder} yet: is `sprag serve` or `sprag worker` running?"
    age = datetime.now(UTC) - found[-1][0]
    return age < _OLD_BACKUP, f"{len(found)} in {folder}, the latest {age.total_seconds() / 3600:.0f} hours old"


def _cache() -> tuple[bool, str]:
    from sprag.worker.models import cache_folder, cache_is_wanted

    folder = cache_folder()
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=folder, prefix=".doctor-") as probe:
        probe.write(b"x")
    if not cache_is_wanted():
        return False, f"the configured folder is not writable, so kernels are kept in {folder}: set SPRAG_KERNEL_CACHE"
    return os.access(folder, os.W_OK | os.X_OK), str(folder)


def _known_values() -> tuple[bool, str]:
    from sprag.service.jobs.self_check import check_known_values

    wrong, largest = check_known_values()
    if wrong:
        return False, "; ".join(wrong)
    return True, f"closed forms and a reference case agree within {largest:.1e}"
