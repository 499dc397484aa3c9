"""``sprag admin doctor``: checks of the installation."""

from __future__ import annotations

import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer

from sprag_study.service.cli.common import access, token_sentences, wants_json
from sprag_study.service.cli.configured import read_settings
from sprag_study.service.cli.console import ExitCode, WrongInputError, console, write_json, write_text
from sprag_study.service.cli.options import Database
from sprag_study.service.faults import Fault
from sprag_study.service.languages import N_, _, decimal, recorded
from sprag_study.worker.limits import MAX_TOLERANCE, MIN_TOLERANCE

_LIBRARIES = ("numpy", "scipy", "numba", "llvmlite", "sqlalchemy", "fastapi", "uvicorn")
#: Default shape of the kernel to print.
_KERNEL = {"pendulums": 1, "coefficients": 4, "tolerance": 1e-9}


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of one check. ``ok`` False means that the user must act."""

    subject: str
    ok: bool
    detail: str


def doctor(
    db: Database = None,
    kernel: Annotated[
        bool,
        typer.Option(
            "--kernel",
            help="Print the generated source of a kernel instead; --pendulums, --coefficients and --tolerance choose "
            "it.",
        ),
    ] = False,
    pendulums: Annotated[
        int | None, typer.Option(min=1, hidden=True, help="Pendulums of that kernel; default: 1.")
    ] = None,
    coefficients: Annotated[
        int | None, typer.Option(min=1, hidden=True, help="Its clutch coefficients; default: 4.")
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(min=MIN_TOLERANCE, max=MAX_TOLERANCE, hidden=True, help="Tolerance it is for; default: 1e-9."),
    ] = None,
) -> None:
    """Check versions, database, permissions, disk, backups, kernels and known values; exit code 3 on any problem."""
    shape = {"pendulums": pendulums, "coefficients": coefficients, "tolerance": tolerance}
    given = {name: value for name, value in shape.items() if value is not None}
    if kernel:
        _show_kernel(_KERNEL | given)
        return
    if given:
        problems = [
            Fault(f"--{name}", "not-used", N_("belongs to --kernel, which is not given"), value)
            for name, value in given.items()
        ]
        raise WrongInputError("invalid-parameter", _("invalid option"), problems)
    screen, findings = console(), []
    for finding in examine(db):
        findings.append(finding)
        if wants_json():
            continue
        mark, style = (_("ok"), "green") if finding.ok else (_("WRONG"), "bold red")
        screen.print(f"{mark:>5}", style=style, end="  ")
        screen.print(f"{finding.subject}: {finding.detail}", markup=False, soft_wrap=True)
        sys.stdout.flush()
    sound = all(finding.ok for finding in findings)
    if wants_json():
        write_json({"sound": sound, "findings": [asdict(finding) for finding in findings]})
    if not sound:
        raise typer.Exit(ExitCode.TROUBLE)


def _show_kernel(shape: dict[str, Any]) -> None:
    from sprag_study.worker.models import MAX_COEFFICIENTS, MAX_PENDULUMS, kernel_source

    for name, most in (("pendulums", MAX_PENDULUMS), ("coefficients", MAX_COEFFICIENTS)):
        if shape[name] > most:
            problem = Fault(f"--{name}", "unknown-name", N_("is out of range"), shape[name], allowed=f"1 .. {most}")
            raise WrongInputError("invalid-parameter", _("invalid option"), [problem])
    text = kernel_source(**shape)
    if wants_json():
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
        here = {
            "SQLite": _sqlite,
            _("rights"): lambda: _rights(file),
            _("disk"): lambda: _disk(file),
            _("backups"): _backups,
        }
    return {
        _("versions"): _versions,
        _("database"): lambda: _database(url, file),
        _("clock"): lambda: _clock(url, file),
        _("workers"): lambda: _workers(url, file),
        _("schedules"): lambda: _schedules(url, file),
        _("alerts"): lambda: _alerts(url, file),
        _("service of commands"): _access,
        **here,
        _("kernel cache"): _cache,
        _("engine"): _known_values,
    }


def _versions() -> tuple[bool, str]:
    libraries = ", ".join(f"{name} {version(name)}" for name in _LIBRARIES)
    text = _(
        "Sprag {version}, Python {python} on {system}",
        version=version("sprag-study"),
        python=platform.python_version(),
        system=f"{platform.system()} {platform.machine()}",
    )
    return sys.version_info >= (3, 11), f"{text}, {libraries}"


def _sqlite() -> tuple[bool, str]:
    from sprag_study.service.storage.database.sqlite_files import sqlite_version, sqlite_warning

    warning = sqlite_warning()
    return warning is None, warning or ".".join(map(str, sqlite_version()))


def _database(url: str, file: Path | None) -> tuple[bool, str]:
    from sprag_study.service.storage.database.session import Session
    from sprag_study.service.storage.maintenance import MOVING, other_revision, revision
    from sprag_study.service.storage.tables import HEAD_REVISION

    if file is not None and not file.exists():
        return True, _("{file} (not created yet)", file=file)
    session = Session(url, create=False)
    try:
        found, location = revision(session), session.location
        if found is not None and found.startswith(MOVING):
            return False, str(other_revision(session, found))
    finally:
        session.close()
    if found not in (None, HEAD_REVISION):
        return False, _(
            "{database} has revision {found}, this program needs {needed}: run `sprag admin db upgrade`",
            database=location,
            found=found,
            needed=HEAD_REVISION,
        )
    return True, _("{database}, revision {revision}", database=location, revision=found or _("none yet"))


def _rights(file: Path) -> tuple[bool, str]:
    """Whether the database and its backups are private; earlier versions created them readable by everybody."""
    from sprag_study.service.jobs.maintenance import backups
    from sprag_study.service.storage.database.private_files import readable_by_others

    folder = read_settings().backup_folder
    copies = [path for _, path in backups(Path(folder).expanduser())] if folder else []
    beside = [file.with_name(f"{file.name}{suffix}") for suffix in ("", "-wal", "-shm", ".lock", ".reserve")]
    shared = [str(path) for path in (*beside, *copies) if path.exists() and readable_by_others(path)]
    if shared:
        return False, _(
            "others can read {files}: `chmod 600` keeps digests of tokens and designs private", files=", ".join(shared)
        )
    return True, _("only their owner can read database and backups")


def _clock(url: str, file: Path | None) -> tuple[bool, str]:
    from sprag_study.service.storage.clock_watch import clock_problem
    from sprag_study.service.storage.store import Store

    now = _("it is {time}", time=datetime.now(UTC).isoformat(timespec="seconds"))
    if file is not None and not file.exists():
        return True, now
    with Store.open(url, create=False) as store:
        problem = clock_problem(store.dispatchers)
    return problem is None, problem or now


def _workers(url: str, file: Path | None) -> tuple[bool, str]:
    """Whether a dispatcher is at work and can run cases; that none runs is no fault of the installation."""
    from sprag_study.service.jobs.workers import worker_list
    from sprag_study.service.storage.store import Store

    if file is not None and not file.exists():
        return True, _("none yet")
    with Store.open(url, create=False) as store:
        found = worker_list(store.dispatchers)
    alive = [item for item in found["dispatchers"] if not (item["silent"] or item["ended_at"])]
    silent = [item["owner"] for item in found["dispatchers"] if item["silent"] and not item["ended_at"]]
    if silent:
        who = ", ".join(silent)
        return False, _(
            "no heartbeat from {names}: `sprag admin worker --take-over` replaces a worker that hangs", names=who
        )
    if not alive:
        return True, _("none is running")
    if shortage := next((item["shortage"] for item in alive if item["shortage"]), None):
        return False, shortage
    hosts = [host for item in alive for host in item["hosts"]]
    threads, names = sum(host["idle_threads"] for host in hosts), {host["host"] for host in hosts}
    parts = [_("{usable} usable on {hosts} hosts", usable=found["usable"], hosts=len(names))]
    parts.append(_("{count} idle threads", count=threads))
    parts.append(_("{count} chunks in flight", count=found["chunks_in_flight"]))
    parts.append(_("{rate} cases/s", rate=decimal(f"{sum(host['cases_per_second'] for host in hosts):.3g}")))
    parts += [_("{count} dispatchers", count=len(alive))] * (len(alive) > 1)
    refused = [
        _("{worker} is refused: {why}", worker=it["address"], why=_(it["reason"]))
        for one in alive
        for it in one["refused"]
    ]
    return not refused, "; ".join([", ".join(parts), *refused])


def _schedules(url: str, file: Path | None) -> tuple[bool, str]:
    """Whether something has run whenever it should."""
    from sprag_study.service.jobs.reports.watchdog import late_runs
    from sprag_study.service.storage.store import Store

    if file is not None and not file.exists():
        return True, _("none yet")
    with Store.open(url, create=False) as store:
        late, schedules, off = (
            late_runs(store),
            len(store.schedules.all()),
            store.schedules.any() and store.deployment.is_copy(),
        )
    if off:
        return False, _(recorded.COPY)
    if late:
        return False, " ".join(f"{each.run.name or each.run.id}: {each.sentence}" for each in late)
    return True, _("{count} schedules, none is late", count=schedules)


def _alerts(url: str, file: Path | None) -> tuple[bool, str]:
    """Whether a backup failed, or a disk filled, and has not been well since."""
    from sprag_study.service.reading.reader import shown_stored
    from sprag_study.service.storage.store import Store

    if file is not None and not file.exists():
        return True, _("none yet")
    with Store.open(url, create=False) as store:
        alerts = store.alerts.present()
    return not alerts, " ".join(shown_stored(alert.problem) for alert in alerts) or _("none")


def _access() -> tuple[bool, str]:
    """Which service commands ask, and with which token."""
    from sprag_study.service.client.wire import public

    asked = access()
    return True, " ".join([public(asked.server), *token_sentences(asked)])


def _disk(location: Path) -> tuple[bool, str]:
    folder = next(parent for parent in location.absolute().parents if parent.exists())
    free = shutil.disk_usage(folder).free
    text = _("{size} GB free at {folder}", size=decimal(f"{free / 1e9:.3g}"), folder=folder)
    return free >= read_settings().disk_free * 2**20, text


def _backups() -> tuple[bool, str]:
    from sprag_study.service.jobs.maintenance import OLDEST_BACKUP, backups

    folder = read_settings().backup_folder
    if not folder:
        return True, _("no backups are made (SPRAG_BACKUP_FOLDER is not set)")
    found = backups(Path(folder).expanduser())
    if not found:
        return False, _(
            "there is none in {folder} yet: is `sprag serve` or `sprag admin worker` running?", folder=folder
        )
    age = datetime.now(UTC) - found[-1][0]
    hours = round(age.total_seconds() / 3600)
    text = _("{count} in {folder}, the latest {hours} hours old", count=len(found), folder=folder, hours=hours)
    return age < OLDEST_BACKUP, text


def _cache() -> tuple[bool, str]:
    from sprag_study.worker.models import cache_folder, cache_is_wanted

    folder = cache_folder()
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=folder, prefix=".doctor-") as probe:
        probe.write(b"x")
    if not cache_is_wanted():
        return False, _(
            "the configured folder is not one that only this user can write to, so kernels are kept in {folder}: set "
            "SPRAG_KERNEL_CACHE",
            folder=folder,
        )
    return os.access(folder, os.W_OK | os.X_OK), str(folder)


def _known_values() -> tuple[bool, str]:
    from sprag_study.service.jobs.self_check import check_known_values

    wrong, largest = check_known_values()
    if wrong:
        return False, "; ".join(wrong)
    return True, _("closed forms and a reference case agree within {error}", error=decimal(f"{largest:.1e}"))
