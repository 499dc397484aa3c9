"""What the pages of a case along a parameter have in common: the branch of its motion, and its bifurcation diagram."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any
from urllib.parse import urlencode

from fastapi import Query

from sprag.service.http.reading import read_as
from sprag.service.http.web.study import study_frame
from sprag.service.languages import _
from sprag.service.results.selection import axis_name
from sprag.service.views.branch import free_parameters, ranged_axes

if TYPE_CHECKING:
    from sprag.service.http.context import Context
    from sprag.worker.study import Study

Text = Annotated[str, Query(max_length=400)]
Begin = Annotated[str, Query(alias="from", max_length=80)]
End = Annotated[str, Query(alias="to", max_length=80)]


def along_frame(
    context: Context,
    study_id: str,
    study: Study,
    case: int,
    entered: dict[str, str],
    start: int | None,
    *,
    initial: bool = False,
) -> dict[str, Any]:
    """What the template of these pages shows around their figures.

    ``entered`` are the fields of their form, which offers initial values only if ``initial``.
    """
    return {
        **study_frame(context, study_id),
        **entered,
        "tab": "/rows",
        "case": case,
        "start": "" if start is None else str(start),
        "read_as": read_as(),
        "own": f"/studies/{study_id}/cases/{case}",
        "choices": _choices(study, case, initial=initial),
    }


def _choices(study: Study, case: int, *, initial: bool) -> list[tuple[str, list[tuple[str, str]]]]:
    """The parameters to choose from, axes of the study first: for each group a path and a name of each."""
    axes = {path: axis_name(study, path) for path in ranged_axes(study, initial=initial)}
    on_axes = {path for name in axes.values() for path in name.split(" = ")}
    others = [(path, path) for path in free_parameters(study, case, initial=initial) if path not in on_axes]
    return [(_("Axes of the study"), list(axes.items())), (_("Other parameters"), others)]


def query_of(asked: dict[str, str], start: int | None) -> str:
    """The query of a figure: what is not empty, and the start."""
    given = {name: text for name, value in asked.items() if (text := value.strip())}
    return urlencode(given if start is None else {**given, "start": start})
