"""``sprag admin workers``: the processes that run cases, by host."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import Column, say, show_table, table_words, time_text, write_json
from sprag_study.service.cli.remote import connection
from sprag_study.service.languages import _

if TYPE_CHECKING:
    from sprag_study.service.answers.workers import Dispatcher


def workers() -> None:
    """Show the workers of the service by host, and those that are refused, with the reason."""
    with connection() as client:
        found = client.workers()
    if wants_json():
        write_json(found)
        return
    with table_words():
        headings = (_("workers"), _("usable"), _("busy"), _("idle threads"), _("refused"), _("cases/s"))
        columns: list[Column] = [(_("host"), False, True), (_("processor"), False, True)]
        columns += [(heading, True) for heading in headings]
        fields = ("host", "processor", "workers", "usable", "busy", "idle_threads", "refused", "cases_per_second")
        # A host with two dispatchers has a row for each: the process tells them apart.
        columns.append((_("dispatcher"), False, True))
        # The workers of a dispatcher that does not respond are not known.
        known = [item for item in found["dispatchers"] if not (item["silent"] or item["ended_at"])]
        rows = [[*(dict(host)[field] for field in fields), item["owner"]] for item in known for host in item["hosts"]]
        if rows:
            show_table("", columns, rows)
    if not found["dispatchers"]:
        say(_("No dispatcher has worked on this database yet."))
    for item in found["dispatchers"]:
        if item["ended_at"]:
            say(_("The dispatcher {name} has ended, and no other is at work.", name=item["owner"]))
        elif item["silent"]:
            since = time_text(item["heartbeat_at"])
            say(_("The dispatcher {name} has not responded since {time}.", name=item["owner"], time=since))
        else:
            _say_at_work(item)
            _say_more(item, first=found["dispatchers"][0]["owner"])


def _say_more(item: Dispatcher, first: str) -> None:
    """What is particular about a dispatcher at work, below its own line; it is compared with the ``first`` one."""
    if item["dashboard"]:
        say(_("Dask's dashboard: {url}", url=item["dashboard"]))
    if item["differs"]:
        say(_("Its fingerprint differs from that of {name}: {difference}.", name=first, difference=item["differs"]))
    if item["shortage"]:
        say(_(item["shortage"]))
    for worker in item["refused"]:
        say(_("{worker} is refused: {why}", worker=worker["address"], why=_(worker["reason"])))


def _say_at_work(item: Dispatcher) -> None:
    values: dict[str, object] = {"name": item["owner"], "count": item["studies"], "chunks": item["chunks_in_flight"]}
    if item["fingerprint"]:
        values["hash"] = item["fingerprint"][:12]
        say(_("The dispatcher {name} has {count} studies and {chunks} chunks in flight, fingerprint {hash}.", **values))
    else:
        say(_("The dispatcher {name} has {count} studies and {chunks} chunks in flight.", **values))
