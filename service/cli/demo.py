"""``sprag demo``: the example study end to end, over HTTP, as a user would do it."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from service.cli.console import ExitCode, TroubleError, say, show_table, write_json
from service.cli.files import file_failure, write_pieces
from service.cli.options import JsonFlag
from service.cli.remote import connection, follow
from service.client import ServiceClient
from worker.kernels import OK

PRESET = "one_pendulum"
#: The service starts in about two seconds; a slow disk may take many times that.
_START_SECONDS = 60.0
_STOP_SECONDS = 15.0
_AXIS = "shaft.load"
_HELD = (("excitation.frequency", "25 Hz"), ("excitation.amplitude_x", "2 mm"))
_SHOWN = ("shaft.speed.mean", "shaft.speed.max", "torque.mean", "power.useful.mean", "efficiency")
_HEADINGS = (
    "load [N*m]",
    "mean speed [rad/s]",
    "max speed [rad/s]",
    "torque [N*m]",
    "power [W]",
    "efficiency",
    "ending",
)
_BAR = 24


def demo(
    leave: Annotated[bool, typer.Option("--exit", help="End after the demonstration instead of serving on.")] = False,
    folder: Annotated[str, typer.Option("--dir", metavar="FOLDER", help="Folder for database and picture.")] = "demo",
    as_json: JsonFlag = False,
) -> None:
    """Run the example study end to end: start a service, submit over HTTP, show the curve, then serve on."""
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise file_failure(target, error) from error
    with _service(target / "sprag.sqlite3") as (address, process), connection(address, None) as client:
        _wait_until_ready(client, process)
        study = _show(client, target / "curve.png", as_json)
        if not leave:
            say(f"Open {address}{study['links']['page']} (Ctrl-C ends the service).")
            process.wait()
    if study["progress"]["ok"] != study["progress"]["total"]:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def _service(database: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A service on a free port of this machine; ended, with all its processes, when the block is left."""
    port = _free_port()
    command = [sys.executable, "-m", "service.cli", "serve", "--port", str(port), "--db", str(database)]
    environment = {name: value for name, value in os.environ.items() if name not in ("SPRAG_TOKEN", "SPRAG_HOST")}
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, start_new_session=True)
    try:
        yield f"http://127.0.0.1:{port}", process
    finally:
        _stop(process)


def _stop(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
    try:
        process.wait(_STOP_SECONDS)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _wait_until_ready(client: ServiceClient, process: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + _START_SECONDS
    while not client.ready():
        if process.poll() is not None:
            raise TroubleError("The service did not start; what it said stands above.")
        if time.monotonic() > deadline:
            raise TroubleError(f"The service did not answer within {_START_SECONDS:.0f} s.")
        time.sleep(0.1)


def _show(client: ServiceClient, picture: Path, as_json: bool) -> dict[str, Any]:
    """Submit the study, follow it, show its curve and write the picture; the study at its end."""
    from service.presets import preset_text
    from service.spec_text import load_spec

    _, text = preset_text(PRESET)
    spec = load_spec(text, "json")
    created = client.create_study(spec)
    say(f"Submitted {created['name']!r} to {client.server}: {created['cases']} cases.")
    start = time.monotonic()
    study = follow(client, created["id"])
    say(f"{study['progress']['done']} cases done in {time.monotonic() - start:.1f} s, {study['progress']['ok']} ok.")
    query = [("x", _AXIS), *(("y", name) for name in _SHOWN), *(("at", f"{path}={value}") for path, value in _HELD)]
    curves = client.curves(study["id"], query)
    write_pieces(str(picture), client.picture(study["id"], query, picture.suffix[1:]))
    if as_json:
        write_json({"study": study, "curves": curves, "picture": str(picture), "server": client.server})
    else:
        _show_curve(curves)
    say(f"Picture of the curve: {picture}")
    return study


def _show_curve(curves: dict[str, Any]) -> None:
    """The mechanical characteristic as a table, the mean speed also as a bar."""
    (drawn,) = curves["curves"]
    columns = [drawn["y"][name] for name in _SHOWN]
    top = max((speed for speed in columns[0] if speed is not None), default=0.0) or 1.0
    rows = [
        (load, *results, "" if ending == OK else ending, "#" * round(_BAR * max(results[0] or 0.0, 0.0) / top))
        for load, ending, *results in zip(drawn["x"], drawn["endings"], *columns, strict=True)
    ]
    held = ", ".join(f"{path} {value}" for path, value in _HELD)
    headings = [(heading, heading != "ending") for heading in _HEADINGS]
    show_table(f"Mechanical characteristic at {held}", [*headings, ("mean speed", False)], rows)
