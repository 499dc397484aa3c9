"""The service over HTTP with plain JSON data in and out, for the command line."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sprag.service.client.queries import longer_query
from sprag.service.client.synchronous.connection import Connection
from sprag.service.client.wire import (
    Drawn,
    Query,
    case_path,
    component_path,
    model_path,
    schedule_path,
    study_path,
    view_path,
    within,
)


class ServiceClient(Connection):
    """A connection to a running service, a method for each operation that a command needs."""

    def __enter__(self) -> ServiceClient:
        return self

    def create_study(
        self,
        spec: object,
        key: str | None = None,
        priority: int = 0,
        fresh: bool = False,
        finish_by: str | None = None,
    ) -> dict[str, Any]:
        """Submit a study; the same ``key`` submits it once, however often it is sent.

        A ``fresh`` study runs every case, even those that other studies already have. With ``finish_by``, a time with
        its offset or a duration such as "8 h", it is run coarse to fine and held then.
        """
        query = [("priority", str(priority))] if priority else []
        query += [("fresh", "true")] if fresh else []
        query += [("finish_by", finish_by)] if finish_by is not None else []
        return self.request("POST", "/studies", json=spec, key=key or "", params=query)

    def extend(self, study_id: str, addition: object, key: str | None = None) -> dict[str, Any]:
        """Submit a study with more values on the axes of an old one (``axes``), or more cases (``cases``).

        The same ``key`` submits it once, however often it is sent.
        """
        return self.request("POST", f"{study_path(study_id)}:extend", json=addition, key=key or "")

    def run_longer(
        self, study_id: str, regime: str | None = None, at_most: int | None = None, key: str | None = None
    ) -> dict[str, Any]:
        """Submit a study of the unsettled cases of another, with more time for each.

        The same ``key`` submits it once, however often it is sent.
        """
        query = longer_query(regime, at_most)
        return self.request("POST", f"{study_path(study_id)}:longer", params=query, key=key or "")

    def narrow(self, study_id: str, query: Query = (), key: str | None = None) -> dict[str, Any]:
        """Submit the sweep of a study once more, with smaller steps where its motion jumps.

        The same ``key`` submits it once, however often it is sent.
        """
        return self.request("POST", f"{study_path(study_id)}:narrow", params=query, key=key or "")

    def select(self, study_id: str, query: Query = (), key: str | None = None) -> dict[str, Any]:
        """Submit a study of the first cases of a selection; the query is that of `explore`, without ``show``."""
        return self.request("POST", f"{study_path(study_id)}:select", params=query, key=key or "")

    def preview(self, spec: object) -> dict[str, Any]:
        """Number of cases, estimated time and size of a study that is not submitted."""
        return self.request("POST", "/studies:preview", json=spec)

    def study(self, study_id: str, timeout: float | None = None) -> dict[str, Any]:
        """One study with its state, progress and time left, requested with ``timeout`` s."""
        return self.request("GET", study_path(study_id), timeout=within(timeout))

    def studies(self, query: Query = ()) -> Iterator[dict[str, Any]]:
        """The studies that the query asks for; its ``page_size`` sets how many are requested at a time."""
        return self.items("/studies", "studies", query)

    def act(self, study_id: str, verb: str, query: Query = ()) -> dict[str, Any]:
        """Request a change of a study: "cancel", "pause", "resume", "retry", "prioritize" or "restore"."""
        return self.request("POST", f"{study_path(study_id)}:{verb}", params=list(query))

    def drawn(self, study_id: str, part: Drawn, query: Query) -> dict[str, Any]:
        """Curves of results against one axis, a map over two, what results depend on, a ribbon or a yield."""
        return self.request("GET", f"{study_path(study_id)}/{part}", params=list(query))

    def calibration(self, study_id: str) -> dict[str, Any]:
        """What a calibration has found."""
        return self.request("GET", f"{study_path(study_id)}/calibration")

    def calibration_file(self, study_id: str, form: str, query: Query = ()) -> Iterator[bytes]:
        """The same as "csv", a row for each measured value, or as a picture: "svg", "png" or "pdf"."""
        return self.download(f"{study_path(study_id)}/calibration", [*query, ("format", form)])

    def answers(self, study_id: str, query: Query = ()) -> dict[str, Any]:
        """What people ask of a study first."""
        return self.request("GET", f"{study_path(study_id)}/answers", params=list(query))

    def answers_file(self, study_id: str, query: Query) -> Iterator[bytes]:
        """The same as a file, by the query's ``format``."""
        return self.download(f"{study_path(study_id)}/answers", query)

    def explore(self, study_id: str, query: Query = ()) -> dict[str, Any]:
        """A selection of cases by ranges and kinds, with histograms."""
        return self.request("GET", f"{study_path(study_id)}/explore", params=list(query))

    def explore_file(self, study_id: str, query: Query) -> Iterator[bytes]:
        """The same as a file, by the query's ``format``."""
        return self.download(f"{study_path(study_id)}/explore", query)

    def front(self, study_id: str, query: Query = ()) -> dict[str, Any]:
        """The designs of a study with a goal."""
        return self.request("GET", f"{study_path(study_id)}/front", params=list(query))

    def front_file(self, study_id: str, query: Query) -> Iterator[bytes]:
        """The same as a file, by the query's ``format``."""
        return self.download(f"{study_path(study_id)}/front", query)

    def picture(self, study_id: str, part: Drawn, query: Query, form: str) -> Iterator[bytes]:
        """The same as a picture, "svg", "png" or "pdf"."""
        return self.download(f"{study_path(study_id)}/{part}", [*query, ("format", form)])

    def case_pages(self, study_id: str, query: Query = ()) -> Iterator[dict[str, Any]]:
        """Pages of case rows, each with ``cases`` and ``units``; ``page_size`` as for `studies`."""
        return self.pages(f"{study_path(study_id)}/cases", query)

    def of_case(self, study_id: str, case: int, part: str, query: Query) -> dict[str, Any]:
        """One case, or a part of it, such as "/branch"."""
        return self.request("GET", case_path(study_id, case, part), params=list(query))

    def case_file(self, study_id: str, case: int, part: str, query: Query) -> Iterator[bytes]:
        """A part of a case as a file, by the query's ``format``."""
        return self.download(case_path(study_id, case, f"/{part}"), query)

    def rounds(self, study_id: str) -> dict[str, Any]:
        """The rounds of a study that chooses its own cases."""
        return self.request("GET", f"{study_path(study_id)}/rounds")

    def delete_study(self, study_id: str, query: Query = ()) -> None:
        """Delete a study that has ended, with all its results."""
        self.delete(study_path(study_id), query)

    def change_study(self, study_id: str, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Change what people write about a study: its name, notes, tags, and whether it is archived."""
        return self.request("PATCH", study_path(study_id), json=dict(fields))

    def models(self) -> dict[str, Any]:
        """Every model with its parameters, results and endings."""
        return self.request("GET", "/models")

    def model(self, name: str) -> dict[str, Any]:
        """One model with its parameters, results and endings."""
        return self.request("GET", model_path(name))

    def components(self, kind: str | None = None) -> dict[str, Any]:
        """The office's own components, or those of a kind."""
        return self.request("GET", "/components", params={} if kind is None else {"kind": kind})

    def put_components(self, body: Mapping[str, Any]) -> dict[str, Any]:
        """Add components or replace those of the same kind and name: ``components``, or ``csv``."""
        return self.request("POST", "/components", json=body)

    def delete_component(self, component_id: str) -> None:
        """Remove a component."""
        self.delete(component_path(component_id))

    def views(self, study_id: str | None = None) -> dict[str, Any]:
        """Saved views, or those of a study."""
        return self.request("GET", "/views", params={} if study_id is None else {"study": study_id})

    def save_view(self, body: Mapping[str, Any]) -> dict[str, Any]:
        """Save a view or replace the one of the same study, page and name."""
        return self.request("POST", "/views", json=body)

    def change_view(self, view_id: str, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Change a view: its name, its choices, its place in the report."""
        return self.request("PATCH", view_path(view_id), json=dict(fields))

    def delete_view(self, view_id: str) -> None:
        """Delete a view."""
        self.delete(view_path(view_id))

    def download(self, path: str, query: Query = ()) -> Iterator[bytes]:
        """The bytes of a document under the API, such as ``/studies/ID/results`` with ``format=csv``, as they come."""
        with self.pieces(path, query) as pieces:
            yield from pieces

    def results(self, study_id: str, form: str, query: Query = ()) -> Iterator[bytes]:
        """All rows of a study in the named format; the query may have ``units``.

        Raises UnreachableError at the end where cases are missing.
        """
        with self.rows(study_path(study_id), form, query) as pieces:
            yield from pieces

    def report(self, study_id: str, form: str, query: Query = ()) -> Iterator[bytes]:
        """The study as a document, "html" or "pdf"; the query may have ``units`` and what the title block says."""
        return self.download(f"{study_path(study_id)}/report", [*query, ("format", form)])

    def workers(self) -> dict[str, Any]:
        """The dispatcher and its workers by host, with those that are refused and why."""
        return self.request("GET", "/workers")

    def schedules(self) -> dict[str, Any]:
        """Every schedule with its last and its next run."""
        return self.request("GET", "/schedules")

    def night(self, hours: float = 24) -> dict[str, Any]:
        """Every due time of the last ``hours`` with its outcome."""
        return self.request("GET", "/night", params={"hours": hours})

    def schedule(self, schedule_id: str) -> dict[str, Any]:
        """One schedule with its spec and its latest runs."""
        return self.request("GET", schedule_path(schedule_id))

    def create_schedule(self, fields: Mapping[str, Any], key: str | None = None) -> dict[str, Any]:
        """Create a schedule; the same ``key`` creates it once."""
        return self.request("POST", "/schedules", json=dict(fields), key=key or "")

    def change_schedule(self, schedule_id: str, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Change some fields of a schedule."""
        return self.request("PATCH", schedule_path(schedule_id), json=dict(fields))

    def delete_schedule(self, schedule_id: str) -> None:
        """Delete a schedule; its studies are kept."""
        self.delete(schedule_path(schedule_id))
