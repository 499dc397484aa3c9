"""``sprag demo``: the example study end to end, over HTTP."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import ExitCode, TroubleError, draw_table, say, write_json
from sprag_study.service.cli.files import file_failure, write_pieces
from sprag_study.service.cli.following import follow
from sprag_study.service.cli.remote import served_by
from sprag_study.service.languages import N_, _, decimal
from sprag_study.service.login import access_of

if TYPE_CHECKING:
    from sprag_study.service.client import Client

PRESET = "one_pendulum"
_STOP_SECONDS = 15.0
_AXIS = "shaft.load"
_HELD = (("excitation.frequency", "25 Hz"), ("excitation.amplitude_x", "2 mm"))
_SHOWN = ("shaft.speed.mean", "shaft.speed.max", "torque.mean", "power.useful.mean", "efficiency")
_TABLE = (
    ("shaft.speed.mean", N_("mean speed\n[rad/s]")),
    ("torque.mean", N_("torque\n[N*m]")),
    ("power.useful.mean", N_("power\n[W]")),
    ("efficiency", N_("efficiency")),
)
_BAR = 20


def demo(
    leave: Annotated[bool, typer.Option("--exit", help="Stop the service after the demonstration.")] = False,
    folder: Annotated[str, typer.Option("--dir", metavar="FOLDER", help="Folder for database and picture.")] = "demo",
) -> None:
    """Run the example study end to end: start a service, submit over HTTP, show the curve, then keep serving."""
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise file_failure(target, error) from error
    with _service(target / "sprag.sqlite3") as (address, process), served_by(access_of(address, None)) as client:
        study = _show(client, target / "curve.png")
        if not leave:
            say(_("Open {address} (Ctrl-C ends the service).", address=address + study["links"]["page"]))
            with suppress(KeyboardInterrupt):
                process.wait()
    if study["progress"]["ok"] != study["progress"]["total"]:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


@contextmanager
def _service(database: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A service on a free port of this machine; ended with all its processes at the end of the block."""
    command = [sys.executable, "-m", "sprag_study.service.cli", "serve", "--json", "--port", "0", "--db", str(database)]
    # Settings of a shared service would prevent the demonstration from accessing its own.
    environment = {name: value for name, value in os.environ.items() if name not in ("SPRAG_TOKEN", "SPRAG_HOST")}
    process = subprocess.Popen(  # noqa: S603 - this program itself
        command, env=environment, stdout=subprocess.PIPE, start_new_session=True
    )
    try:
        yield _address(process), process
    finally:
        _stop(process)


def _address(process: subprocess.Popen[bytes]) -> str:
    """The address that the service prints once it listens."""
    assert process.stdout is not None
    with process.stdout as output:
        line = output.readline()
    if not line:
        raise TroubleError("unavailable", _("The service did not start; its messages are above."))
    return str(json.loads(line)["address"])


def _stop(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
    try:
        process.wait(_STOP_SECONDS)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _show(client: Client, picture: Path) -> dict[str, Any]:
    """Submit the study, follow it, show its curve and write the picture; the study at its end."""
    from sprag_study.service.client.wire import study_path
    from sprag_study.service.presets import preset_text
    from sprag_study.service.spec.text import load_spec
    from sprag_study.worker.models import cache_folder

    text = preset_text(PRESET)[1]
    spec = load_spec(text, "json")
    created = client.request("POST", "/studies", json=spec, key="")
    what = {"name": repr(created["name"]), "cases": created["cases"]}
    say(_("Submitted {name} to {server}: {cases} cases.", server=client.server, **what))
    if not any(cache_folder().iterdir()):
        say(_("The kernel is compiled first; this takes a few seconds, once."))
    start = time.monotonic()
    study = follow(client, created["id"], patient=False)
    seconds = decimal(f"{time.monotonic() - start:.1f}")
    done = {"done": study["progress"]["done"], "ok": study["progress"]["ok"]}
    say(_("{done} cases done in {seconds} s, {ok} ok.", seconds=seconds, **done))
    query = [("x", _AXIS), *(("y", name) for name in _SHOWN), *(("at", f"{path}={value}") for path, value in _HELD)]
    path = f"{study_path(study['id'])}/curves"
    curves = client.request("GET", path, params=query)
    with client.pieces(path, [*query, ("format", picture.suffix[1:])]) as pieces:
        write_pieces(str(picture), pieces)
    if wants_json():
        write_json({"study": study, "curves": curves, "picture": str(picture), "server": client.server})
    else:
        _show_curve(curves)
    say(_("Picture of the curve: {file}", file=picture))
    return study


def _show_curve(curves: dict[str, Any]) -> None:
    """The mechanical characteristic as a table, the mean speed also as a bar."""
    from sprag_study.worker.models import OK

    (drawn,) = curves["curves"]
    columns = [
        [None if value is None else decimal(f"{value:.4g}") for value in drawn["y"][name]] for name, _heading in _TABLE
    ]
    speeds = [max(speed or 0.0, 0.0) for speed in drawn["y"][_TABLE[0][0]]]
    top = max(speeds) or 1.0
    bars = [
        "#" * round(_BAR * speed / top) if ending == OK else ending
        for speed, ending in zip(speeds, drawn["endings"], strict=True)
    ]
    held = ",\n".join(f"{path} {value}" for path, value in _HELD)
    headings = [(_("load\n[N*m]"), True), *((_(heading), True) for _name, heading in _TABLE), (_("mean speed"), False)]
    rows = list(zip(drawn["x"], *columns, bars, strict=True))
    draw_table(_("Mechanical characteristic at {place}", place=held), headings, rows)
