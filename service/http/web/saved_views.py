"""Saved views on pages: saved with a button, listed where they belong, renamed, ordered in the report and removed."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING, Any, Final

from starlette.responses import RedirectResponse, Response

from sprag_study.service.faults import choice_of
from sprag_study.service.http.context import Context, Ctx
from sprag_study.service.http.reading import page_query
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.web.form.values import Form
from sprag_study.service.jobs.saved_views import change_view, save_view
from sprag_study.service.languages import N_, _
from sprag_study.service.spec.saved_views import FIGURES, read_view, read_view_change
from sprag_study.worker.limits import MAX_NAME_LENGTH, MAX_REPORT_FIGURES

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sprag_study.service.storage.saved_views import SavedView

router = page_router()

#: What can be done with a view, and the label of its button.
ACTIONS: Final = {
    "rename": N_("Rename"),
    "earlier": N_("Earlier"),
    "later": N_("Later"),
    "report": N_("Into the report"),
    "take-out": N_("Out of the report"),
    "delete": N_("Delete"),
}


@dataclass(frozen=True, slots=True)
class SavedHere:
    """The saved views of a page, and what a view of its present choices would be: its study, query and name."""

    page: str
    study: str | None
    query: str
    name: str
    found: tuple[SavedView, ...]

    @property
    def is_figure(self) -> bool:
        """Whether views of the page can be in the report."""
        return self.page in FIGURES


def saved_here(
    found: Iterable[SavedView], page: str, study: str | None, query: str | None = None, name: str = ""
) -> SavedHere:
    """The views of ``page`` among ``found``; ``query`` and ``name`` of the present choices, by default its address."""
    mine = tuple(saved for saved in found if saved.view.page == page)
    query = page_query() if query is None else query
    taken = {saved.view.name for saved in mine if saved.view.query != query}
    name = name[: MAX_NAME_LENGTH - 5]
    names = (name if number == 1 else f"{name} ({number})" for number in count(1))
    return SavedHere(page, study, query, next(text for text in names if text not in taken), mine)


def view_actions() -> dict[str, str]:
    """What can be done with a view, and the label of its button."""
    return {name: _(word) for name, word in ACTIONS.items()}


@router.post("/views")
def save(context: Ctx, values: Form) -> Response:
    """Save the choices of a page under a name, and show the page again."""
    given: dict[str, Any] = {name: values[name] for name in ("page", "name", "query") if name in values}
    view = read_view({**given, "study": values.get("study") or None, "in_report": "in_report" in values})
    save_view(context.store, view)
    return RedirectResponse(f"{view.address}#views", status_code=303)


@router.post("/views/{view_id}")
def act(context: Ctx, view_id: str, values: Form) -> Response:
    """A button beside a view."""
    done: str = choice_of("do", values.get("do", ""), ACTIONS)
    saved = context.store.views.get(view_id)
    _act(context, saved, done, values.get("name", ""))
    return RedirectResponse(f"{views_address(saved.view.study)}#saved-views", status_code=303)


def views_address(study_id: str | None) -> str:
    """The page that lists the views of a study, or those of the whole service."""
    return "/" if study_id is None else f"/studies/{study_id}"


def _act(context: Context, saved: SavedView, done: str, name: str) -> None:
    """Do what a button says."""
    place = saved.place or 0
    match done:
        case "delete":
            context.store.views.remove(saved.id)
            return
        case "rename":
            change: dict[str, Any] = {"name": name}
        case "earlier" | "later":
            moved = place - 1 if done == "earlier" else place + 1
            change = {"place": min(max(moved, 1), MAX_REPORT_FIGURES)}
        case _:
            change = {"in_report": done == "report"}
    change_view(context.store, saved.id, read_view_change(change, saved.view.page))
