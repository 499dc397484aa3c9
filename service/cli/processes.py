"""Commands that start processes: serve, worker."""

from __future__ import annotations

import gc
import sys
from typing import Annotated

import typer

from sprag_study.service import languages
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.configured import read_settings
from sprag_study.service.cli.console import TroubleError, WrongInputError, write_json
from sprag_study.service.cli.options import Database, Processes
from sprag_study.service.cli.stores import database_of

Host = Annotated[
    str | None, typer.Option("--host", metavar="ADDRESS", help="Address to listen on; default: this machine only.")
]
Port = Annotated[int | None, typer.Option(min=0, max=65535, help="Port to listen on; 0: any free one.")]


def serve(
    host: Host = None,
    port: Port = None,
    db: Database = None,
    processes: Processes = None,
) -> None:
    """Start the service and its worker; Ctrl-C ends both. With --json the address is printed on standard output."""
    # What is imported stays: looking for garbage among it would take a fifth of the time of the start.
    gc.disable()
    from sprag_study.service.http.server import AddressError
    from sprag_study.service.http.server import serve as run_service
    from sprag_study.service.http.tls import CertificateError
    from sprag_study.service.settings import UnsafeSettingsError

    gc.freeze()
    gc.enable()
    settings = read_settings(
        host=host,
        port=port,
        database=db,
        processes=processes,
    )

    def announce(address: str) -> None:
        write_json({"address": address})
        sys.stdout.flush()

    try:
        with languages.language(languages.ENGLISH):  # of requests and logs, whoever starts the service
            run_service(settings, announce=announce if wants_json() else None)
    except (UnsafeSettingsError, CertificateError) as error:
        raise WrongInputError("invalid-settings", str(error)) from error
    except AddressError as error:
        raise TroubleError("unavailable", str(error)) from error


def worker(
    db: Database = None,
    take_over: Annotated[
        bool,
        typer.Option(
            "--take-over",
            help="Do not wait for another worker, which can then store nothing more; kill it if it hangs. "
            "On PostgreSQL: end the workers that do not respond.",
        ),
    ] = False,
) -> None:
    """Run the studies of a database without a service; Ctrl-C ends it."""
    from sprag_study.service import logs
    from sprag_study.service.jobs.dispatching import run_dispatcher, stop_on_signals, worker_settings

    database_of(db)
    settings = read_settings(database=db)
    logs.configure(settings.log_format, requests=False)
    with languages.language(languages.ENGLISH):
        run_dispatcher(worker_settings(settings), stop_on_signals(), take_over=take_over)
