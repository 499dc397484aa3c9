"""``sprag admin health`` and ``metrics``: whether a service answers and can work, and its numbers."""

from __future__ import annotations

from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import say, warning_lines, write_json, write_text
from sprag_study.service.cli.remote import connection
from sprag_study.service.languages import _


def health() -> None:
    """Ask whether a service answers, and can check, store and run studies; exit code 3 where it cannot."""
    with connection() as client:
        client.live()
        ready = client.ready()
    if wants_json():
        write_json(ready)
        return
    write_text(_("{address} answers; studies can be submitted, read and run", address=client.server) + "\n")
    say(*warning_lines(ready.get("warnings", ())))


def metrics() -> None:
    """Print the metrics of a service in the text format of Prometheus."""
    with connection() as client:
        write_text(client.metrics())
