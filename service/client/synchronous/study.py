"""One study of the service: following it, changing it, and studies made from it."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from contextlib import closing
from typing import TYPE_CHECKING, Any, cast

from sprag_study.service.client.bars import reporting
from sprag_study.service.client.queries import extension, query_of
from sprag_study.service.client.shown import Shown, shown
from sprag_study.service.client.synchronous.following import events_of, wait_for
from sprag_study.service.client.synchronous.tables import StudyTables
from sprag_study.service.client.synchronous.views import StudyViews
from sprag_study.service.client.waiting import Waiting

if TYPE_CHECKING:
    from sprag_study.service.answers.studies import Round, StudyDetail, StudySummary
    from sprag_study.service.client.bars import Progressing
    from sprag_study.service.client.events import StudyEvent
    from sprag_study.service.client.queries import Value
    from sprag_study.service.client.wire import Query


class Study(StudyViews, StudyTables, Shown):
    """One study of the service. ``id`` is its public name, ``summary`` what the service last said of it.

    Fields of the summary are its items, too: ``study["owner"]``.
    """

    def __repr__(self) -> str:
        return f"Study({shown(self.id, self.summary)})"

    def __getitem__(self, field: str) -> Any:
        return (self.summary or {})[field]

    def detail(self) -> StudyDetail:
        """The current study, with its progress and its spec."""
        self.summary = self._get("")
        return cast("StudyDetail", self.summary)

    def rounds(self) -> list[Round]:
        """The rounds of a study that chooses its own cases, each with what was known before it; [] of others."""
        return cast("list[Round]", (self._get("/rounds"))["rounds"])

    def wait(self, *, progress: bool | Progressing | None = None, timeout: float | None = None) -> Study:
        """Wait until the study has ended or reached its deadline; returns the study itself.

        While the service does not answer, for instance during a restart, waiting continues with a warning in the log
        (``sprag_study.service.client.waiting``).

        Parameters
        ----------
        progress : bool or callable, optional
            True shows a bar, on standard error or in the notebook; a function is called with the study from time to
            time. By default a bar in notebooks.
        timeout : float, optional
            Seconds after which StudyTimeoutError is raised; the study continues. NaN raises ValueError.
        """
        with reporting(progress) as tell:
            self.summary = wait_for(self._client, self.id, Waiting(tell, timeout))
        return self

    def events(self) -> Generator[StudyEvent, None, None]:
        """The state of the study whenever it changes, up to its end, also across restarts of the service."""
        with closing(events_of(self._client, self.id)) as events:
            yield from events

    def extend(
        self,
        axes: Sequence[Mapping[str, Any]] | None = None,
        *,
        cases: Sequence[Mapping[str, Any]] | None = None,
        generations: int | None = None,
        name: str | None = None,
        key: str | None = None,
    ) -> Study:
        """Submit a study with this one's cases and more, of which only the new ones are run.

        ``generations`` are further ones of a search with a goal, beyond those that it came to. The same ``key`` submits
        it once, however often it is sent.
        """
        return self._further("extend", key, json=extension(axes, cases, generations, name))

    def run_longer(self, regime: str | None = None, at_most: int | None = None, *, key: str | None = None) -> Study:
        """Submit a study of this one's unsettled cases, with more excitation periods for each.

        For a settled study, the cases of a regime, by default the unsettled ones; otherwise those with the flag
        ``not_settled``.
        """
        return self._further("longer", key, params=query_of({"regime": regime, "at_most": at_most}))

    def narrow(
        self, steps: int | None = None, at: Mapping[str, Value] | None = None, *, key: str | None = None
    ) -> Study:
        """Submit this one's sweep once more, with smaller steps where its motion jumps.

        Each of these steps is split into ``steps`` (16). ``at`` maps paths of other axes to their only values.
        """
        return self._further("narrow", key, params=query_of({"steps": steps, "at": at}))

    def select(
        self,
        where: str | Sequence[str] = (),
        *,
        sort: str | None = None,
        limit: int | None = None,
        ending: str | None = None,
        regime: str | None = None,
        flag: str | None = None,
        key: str | None = None,
    ) -> Study:
        """Submit a study of the first ``limit`` cases (50) that `explore` gives for the same choices, as points.

        Derived parameters follow from the others; a case of a drive with tolerances keeps the values of its drive.
        """
        asked = {"where": where, "sort": sort, "limit": limit, "ending": ending, "regime": regime, "flag": flag}
        return self._further("select", key, params=query_of(asked))

    def _further(self, verb: str, key: str | None, **arguments: Any) -> Study:
        made = self._client.request("POST", f"{self._path}:{verb}", key=key or "", **arguments)
        return type(self)(self._client, made["id"], made)

    def pause(self) -> StudySummary:
        """Hold the study: no new cases are started until it is resumed."""
        return self._act("pause")

    def resume(self) -> StudySummary:
        """Resume the study; a past deadline or a closed window no longer applies."""
        return self._act("resume")

    def cancel(self) -> StudySummary:
        """Stop the study for good; finished cases are kept."""
        return self._act("cancel")

    def retry(self, endings: Sequence[str] = ()) -> StudySummary:
        """Run those cases again that did not end ok, or only those with one of the ``endings``."""
        return self._act("retry", query_of({"ending": endings}))

    def prioritize(self, priority: int) -> StudySummary:
        """Change the priority of the study: among the waiting ones of one user the highest runs first."""
        return self._act("prioritize", [("priority", str(priority))])

    def change(
        self,
        *,
        name: str | None = None,
        notes: str | None = None,
        tags: Sequence[str] | None = None,
        add_tags: Sequence[str] = (),
        remove_tags: Sequence[str] = (),
        archived: bool | None = None,
        etag: str | None = None,
    ) -> StudySummary:
        """Change its name, notes or tags, or archive it; what is None is kept.

        ``tags`` replaces all tags; ``add_tags`` and ``remove_tags`` change those that it has. With the ``etag`` of the
        answer that the change is based on, it is refused (status 412) where somebody changed the study since.
        """
        fields = {"name": name, "notes": notes, "archived": archived, "tags": None if tags is None else list(tags)}
        body = {field: value for field, value in fields.items() if value is not None}
        more = {"add_tags": list(add_tags), "remove_tags": list(remove_tags)}
        body |= {field: value for field, value in more.items() if value}
        return cast("StudySummary", self._client.request("PATCH", self._path, etag=etag, json=body))

    def delete(self, *, at_once: bool = False, etag: str | None = None) -> None:
        """Delete the study, which must have ended or be held at its deadline, with all its results.

        It can be restored for some days, unless it is deleted ``at_once``, which makes room on the disk. ``etag`` as
        for `change`.
        """
        self._client.delete(self._path, [("at_once", "true")] if at_once else (), etag=etag)

    def restore(self) -> StudySummary:
        """Undo the deletion of the study."""
        return self._act("restore")

    def _act(self, verb: str, query: Query = ()) -> StudySummary:
        return cast("StudySummary", self._client.request("POST", f"{self._path}:{verb}", params=list(query)))
