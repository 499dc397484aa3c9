"""The client for scripts and notebooks: studies, schedules, models, presets, clutch fits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, cast, overload

from sprag_study.service.client.queries import finish_text, query_of, spec_of
from sprag_study.service.client.synchronous.comparing import compare
from sprag_study.service.client.synchronous.connection import Connection
from sprag_study.service.client.synchronous.naming import schedule_of, study_of
from sprag_study.service.client.synchronous.selecting import sql
from sprag_study.service.client.synchronous.study import Study
from sprag_study.service.client.wire import (
    component_path,
    model_path,
    preset_path,
    schedule_path,
    study_path,
    token_path,
    user_path,
    view_path,
)

if TYPE_CHECKING:
    from datetime import datetime
    from os import PathLike

    import pandas as pd
    import polars as pl

    from sprag_study.service.answers.catalogue import Health, Model, Preset
    from sprag_study.service.answers.components import ComponentEntry
    from sprag_study.service.answers.people import AuditEntry, CreatedToken, HandedOver, Me, Token, User
    from sprag_study.service.answers.saved_views import SavedViewEntry
    from sprag_study.service.answers.schedules import Night, ScheduleDetail, ScheduleSummary
    from sprag_study.service.answers.studies import ClutchFitReport, Preview
    from sprag_study.service.answers.workers import WorkerList
    from sprag_study.service.client.comparison import Comparison
    from sprag_study.service.client.queries import Held, Spec, Value


class Client(Connection):
    """A connection to a running service, with everything that the service does. Parameters as of the connection."""

    def __enter__(self) -> Client:
        return self

    def preview(
        self, spec: Spec | str | PathLike[str], *, cases: object = None, finish_by: str | datetime | None = None
    ) -> Preview:
        """Preview of a study as `submit` takes it: cases, how many of them can be reused, time, size, warnings."""
        query = query_of({"finish_by": None if finish_by is None else finish_text(finish_by)})
        return cast("Preview", self.request("POST", "/studies:preview", json=spec_of(spec, cases), params=query))

    def submit(
        self,
        spec: Spec | str | PathLike[str],
        *,
        cases: object = None,
        key: str | None = None,
        priority: int = 0,
        fresh: bool = False,
        finish_by: str | datetime | None = None,
    ) -> Study:
        """Submit a study.

        Parameters
        ----------
        spec : mapping, str or path
            A spec, the name of a JSON or TOML file with one, or the name of a study that comes with Sprag. Values may
            be numbers of numpy and decimal, arrays, columns of pandas, and quantities of pint.
        cases : table, optional
            The cases in place of those of the spec: a frame of pandas or polars, a dataset of xarray, a mapping of
            columns or a sequence of mappings, with a column for each parameter, such as "shaft.load", and a row for
            each case. Numbers are in the units of ``attrs["units"]``, by default SI.
        key : str, optional
            The same key submits the study once, however often it is sent.
        priority : int
            Among the waiting studies of a user the one of the highest priority runs first.
        fresh : bool
            Run every case, even those that other studies have.
        finish_by : datetime or str, optional
            An aware time, or a duration such as "8 h": the study is run coarse to fine and held then.
        """
        finish = None if finish_by is None else finish_text(finish_by)
        query = query_of({"priority": priority or None, "fresh": fresh, "finish_by": finish})
        made = self.request("POST", "/studies", key=key or "", json=spec_of(spec, cases), params=query)
        return Study(self, made["id"], made)

    def study(self, study_id: str) -> Study:
        """A study by its id, its name, or the beginning of one; "latest": the newest.

        RefusedError when there is none, AmbiguousError when several fit and none has that name, ArgumentError for
        an empty text, or no text.
        """
        found = study_of(self, study_id)
        detail = self.request("GET", study_path(found))
        return Study(self, detail["id"], detail)

    def studies(
        self,
        state: str | None = None,
        *,
        search: str | None = None,
        tag: str | None = None,
        owner: str | None = None,
        model: str | None = None,
        archived: bool = False,
        deleted: bool = False,
        sort: str | None = None,
    ) -> Iterator[Study]:
        """Every study that is neither archived nor deleted, or those that are searched for.

        Each has its ``summary``, whose fields are its items, too: ``study["owner"]``.

        Parameters
        ----------
        search : str, optional
            Words that occur in the name, the notes, the tags or the id.
        state, tag, owner, model : str, optional
            The only state, tag, and so on.
        archived, deleted : bool
            Only archived studies, or only deleted ones that can be restored.
        sort : str, optional
            "newest" (the default), "name", "state", "cases" or "ended".
        """
        words = {"state": state, "search": search, "tag": tag, "owner": owner, "model": model, "sort": sort}
        query = query_of({**words, "archived": archived, "deleted": deleted})
        for study in self.items("/studies", "studies", query):
            yield Study(self, study["id"], study)

    def compare(
        self,
        studies: Sequence[str],
        x: str | None = None,
        y: str | Sequence[str] = (),
        *,
        by: str | Sequence[str] = (),
        at: Held | None = None,
    ) -> Comparison:
        """Two to ten studies, named as for `study`, side by side, as the function `compare` does."""
        return compare([Study(self, study_of(self, text)) for text in studies], x, y, by=by, at=at)

    @overload
    def sql(
        self,
        statement: str,
        studies: Sequence[str] | Mapping[str, str],
        *,
        units: str | None = None,
        polars: Literal[False] = False,
    ) -> pd.DataFrame: ...

    @overload
    def sql(
        self,
        statement: str,
        studies: Sequence[str] | Mapping[str, str],
        *,
        units: str | None = None,
        polars: Literal[True],
    ) -> pl.DataFrame: ...

    def sql(
        self,
        statement: str,
        studies: Sequence[str] | Mapping[str, str],
        *,
        units: str | None = None,
        polars: bool = False,
    ) -> pd.DataFrame | pl.DataFrame:
        """What a SELECT of DuckDB gives of several studies, each named as for `study`, as the function `sql` does.

        With a mapping, tables have its names: ``{"before": "latest"}``.
        """
        texts = studies if isinstance(studies, Mapping) else dict(enumerate(studies))
        opened = {name: Study(self, study_of(self, text)) for name, text in texts.items()}
        named: Any = opened if isinstance(studies, Mapping) else list(opened.values())
        if polars:
            return sql(statement, named, units=units, polars=True)
        return sql(statement, named, units=units)

    def workers(self) -> WorkerList:
        """The processes that run cases, by host, and those that are refused, with the reason."""
        return cast("WorkerList", self.request("GET", "/workers"))

    def models(self) -> list[Model]:
        """Every model with its parameters, results and endings."""
        return cast("list[Model]", (self.request("GET", "/models"))["models"])

    def model(self, name: str) -> Model:
        """One model with its parameters, results and endings."""
        return cast("Model", self.request("GET", model_path(name)))

    def presets(self) -> list[Preset]:
        """The studies that come with the service, each with its ``spec``, which can be submitted."""
        return cast("list[Preset]", (self.request("GET", "/presets"))["presets"])

    def preset(self, name: str) -> Preset:
        """One study that comes with the service."""
        return cast("Preset", self.request("GET", preset_path(name)))

    def fit_clutch(
        self,
        data: Sequence[Sequence[float | str]] | str,
        accuracy: Value,
        *,
        max_degree: int | None = None,
        through_origin: bool | None = None,
        **more: Any,
    ) -> ClutchFitReport:
        """Fit the clutch law of the least degree that reaches an accuracy to measured pairs of windup and torque.

        Parameters
        ----------
        data : sequence of pairs, or str
            Windup in rad and torque in N*m, or the text of a CSV file of them.
        accuracy : float or str
            Largest residual, in N*m or with a unit.
        max_degree : int, optional
        through_origin : bool, optional
        more
            Further fields of the request.
        """
        rows = data if isinstance(data, str) else [list(row) for row in data]
        fields = {"max_degree": max_degree, "through_origin": through_origin, **more}
        body = {"data": rows, "accuracy": accuracy, **{k: v for k, v in fields.items() if v is not None}}
        return cast("ClutchFitReport", self.request("POST", "/clutch-fits", json=body))

    def components(self, kind: str | None = None) -> list[ComponentEntry]:
        """The office's own springs, clutches and motors, or those of a kind, by kind and name."""
        found = self.request("GET", "/components", params=query_of({"kind": kind}))
        return cast("list[ComponentEntry]", found["components"])

    def put_components(self, components: Sequence[Mapping[str, Any]] | str) -> list[ComponentEntry]:
        """Add components, all or none: mappings with kind, name and fields, or the text of a CSV file.

        Those of the same kind and name are replaced.
        """
        body = {"csv": components} if isinstance(components, str) else {"components": list(components)}
        found = self.request("POST", "/components", json=body)
        return cast("list[ComponentEntry]", found["components"])

    def delete_component(self, component_id: str, *, etag: str | None = None) -> None:
        """Remove a component; studies that took it keep its values. ``etag``: only that edition of it."""
        self.delete(component_path(component_id), etag=etag)

    def schedules(self) -> list[ScheduleSummary]:
        """Every schedule with its last and its next run, newest first."""
        return cast("list[ScheduleSummary]", (self.request("GET", "/schedules"))["schedules"])

    def night(self, hours: float = 24) -> Night:
        """Every due time of the last ``hours`` with its outcome, those that need attention first."""
        return cast("Night", self.request("GET", "/night", params={"hours": hours}))

    def schedule(self, schedule_id: str) -> ScheduleDetail:
        """One schedule, named as a study is in `study`, with its spec and its latest runs."""
        path = schedule_path(schedule_of(self, schedule_id))
        return cast("ScheduleDetail", self.request("GET", path))

    def create_schedule(
        self, spec: Spec | str | PathLike[str], *, key: str | None = None, **fields: Any
    ) -> ScheduleDetail:
        """Submit a study whenever it is due: ``cron`` or ``at``, and ``zone``, ``window``, ``name`` and so on.

        The same ``key`` creates it once, however often it is sent.
        """
        body = {"spec": spec_of(spec), **fields}
        return cast("ScheduleDetail", self.request("POST", "/schedules", key=key or "", json=body))

    def views(self, study: str | None = None) -> list[SavedViewEntry]:
        """Saved views of pages, or those of the study of that id: first the figures of its report, in order."""
        found = self.request("GET", "/views", params=query_of({"study": study}))
        return cast("list[SavedViewEntry]", found["views"])

    def save_view(
        self, page: str, name: str, query: str = "", *, study: str | None = None, in_report: bool = False
    ) -> SavedViewEntry:
        """Save the choices of a page under a name; a view of the same study, page and name is replaced.

        Parameters
        ----------
        page : str
            "curves", "map", "explore", "front", "drives", "sensitivity" or "cases" of a ``study``; "studies" or
            "compare".
        query : str
            The choices as in the address of the page, such as "x=shaft.load&y=efficiency".
        in_report : bool
            Whether these curves or this map are a figure of the study's report.
        """
        body = {"page": page, "name": name, "query": query, "study": study, "in_report": in_report}
        return cast("SavedViewEntry", self.request("POST", "/views", json=body))

    def change_view(self, view_id: str, *, etag: str | None = None, **fields: Any) -> SavedViewEntry:
        """Change some fields of a view: ``name``, ``query``, ``in_report``, or ``place`` in the report.

        With the ``etag`` of the view that was read, it is refused (status 412) where somebody changed it since.
        """
        return cast("SavedViewEntry", self.request("PATCH", view_path(view_id), etag=etag, json=fields))

    def delete_view(self, view_id: str, *, etag: str | None = None) -> None:
        """Delete a saved view; ``etag`` as for `change_view`."""
        self.delete(view_path(view_id), etag=etag)

    def change_schedule(self, schedule_id: str, *, etag: str | None = None, **fields: Any) -> ScheduleDetail:
        """Change some fields of a schedule, such as ``enabled=False``; the others are kept.

        With the ``etag`` of the schedule that was read, it is refused (status 412) where somebody changed it since.
        """
        path = schedule_path(schedule_of(self, schedule_id))
        return cast("ScheduleDetail", self.request("PATCH", path, etag=etag, json=fields))

    def delete_schedule(self, schedule_id: str, *, etag: str | None = None) -> None:
        """Delete a schedule; its studies are kept. ``etag`` as for `change_schedule`."""
        self.delete(schedule_path(schedule_of(self, schedule_id)), etag=etag)

    def me(self) -> Me:
        """Who asks: user, token, role and quotas."""
        return cast("Me", self.request("GET", "/me"))

    def users(self) -> list[User]:
        """Every user with role and quotas, by name; for administrators."""
        return cast("list[User]", (self.request("GET", "/users"))["users"])

    def add_user(self, name: str, role: str = "designer", **limits: int | None) -> User:
        """Add a user; for administrators.

        Parameters
        ----------
        role : str
            "viewer", "designer" or "administrator".
        limits : int or None
            ``most_cases``, ``most_bytes``, ``most_checks``; 0: no limit; None: as the settings have it.
        """
        return cast("User", self.request("POST", "/users", json={"name": name, "role": role, **limits}))

    def change_user(self, name: str, **fields: Any) -> User:
        """Change some fields of a user: ``role``, ``removed``, and the limits as of `add_user`; for administrators."""
        return cast("User", self.request("PATCH", user_path(name), json=fields))

    def hand_over_user(self, name: str, to: str) -> HandedOver:
        """Give the studies, schedules, components and views of a user to another; for administrators."""
        return cast("HandedOver", self.request("POST", "/users:hand-over", json={"name": name, "to": to}))

    def tokens(self) -> list[Token]:
        """Every token without its secret, newest first; for administrators."""
        return cast("list[Token]", (self.request("GET", "/tokens"))["tokens"])

    def create_token(
        self, name: str, *, user: str | None = None, scope: str = "write", days: int | None = None
    ) -> CreatedToken:
        """Create a token, whose secret is the field ``token`` of this answer only; for administrators.

        Parameters
        ----------
        user : str or None
            Whose it is; None: nobody's.
        scope : str
            "read" or "write".
        days : int or None
            For which it is valid; None: always.
        """
        fields = {"name": name, "user": user, "scope": scope, "days": days}
        return cast("CreatedToken", self.request("POST", "/tokens", json=fields))

    def revoke_token(self, token_id: str) -> Token:
        """Revoke a token by its id; for administrators."""
        return cast("Token", self.request("POST", token_path(token_id, ":revoke")))

    def audit(
        self,
        since: str | None = None,
        until: str | None = None,
        *,
        actor: str | None = None,
        action: str | None = None,
        target: str | None = None,
    ) -> Iterator[AuditEntry]:
        """Every change, latest first, or those of a time, a user, an action, a study; for administrators."""
        query = query_of({"since": since, "until": until, "actor": actor, "action": action, "target": target})
        for entry in self.items("/audit", "entries", query):
            yield cast("AuditEntry", entry)

    def live(self) -> Health:
        """Whether the service answers."""
        return cast("Health", self.request("GET", "/livez", once=True))

    def ready(self) -> Health:
        """Whether studies can be submitted, read and run; RefusedError says what is missing."""
        return cast("Health", self.request("GET", "/readyz", once=True))

    def metrics(self) -> str:
        """The metrics for Prometheus, as text."""
        return (self.read("/metrics", ())).decode()
