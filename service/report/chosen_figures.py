"""The figures of a report that somebody chose: saved views of curves and maps, drawn as on their pages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sprag_study.service.faults import SelectionError, refused
from sprag_study.service.figures.curves import curves_figure
from sprag_study.service.figures.pictures import MAX_PICTURE_POINTS, check_size, draw_figure, draw_map, require_drawable
from sprag_study.service.figures.read import read_figure, read_map
from sprag_study.service.languages import _
from sprag_study.service.reading.part_names import lower_first
from sprag_study.service.reading.reader import Choice, reading_for
from sprag_study.service.results.choice import Address, MapQuery, curve_query, map_query
from sprag_study.service.results.curve_cases import drawn_curves, select, stored_map
from sprag_study.service.results.curves import CurveQuery, Map
from sprag_study.service.results.defaults import caption, drawn_numbers

if TYPE_CHECKING:
    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.formats import Picture
    from sprag_study.service.spec.saved_views import View
    from sprag_study.service.storage.store import Store
    from sprag_study.worker.study import Study

CONTOUR: Final = "contour"
#: Panels in a row of curves, as on their page.
_COLUMNS: Final = 2


@dataclass(frozen=True, slots=True)
class ChosenFigure:
    """A figure with the name of its view and what it shows, in the units of its view.

    ``shown`` is None where it cannot be drawn; ``caption`` then says why. ``results`` are those that it shows.
    """

    name: str
    caption: str
    shown: Figure | Map | None = None
    contours: bool = False
    results: tuple[str, ...] = ()

    def draw(self, picture: Picture, title: str = "") -> bytes:
        """The figure as a picture."""
        assert self.shown is not None
        if isinstance(self.shown, Map):
            return draw_map(self.shown, title, picture, contours=self.contours)
        return draw_figure(self.shown, title, picture)


def require_figure(study: Study, view: View) -> None:
    """Raise SelectionError where the study has not what a view of curves or of a map shows, or it cannot be drawn."""
    query = figure_query(study, view)
    curves = CurveQuery(query.x, (query.z,), (query.y,), query.at) if isinstance(query, MapQuery) else query
    select(study, curves)
    check_size("points", drawn_numbers(study, curves), MAX_PICTURE_POINTS)


def chosen_figures(store: Store, study_id: str, choice: Choice) -> tuple[ChosenFigure, ...]:
    """The figures of the report of a study, in order; ``choice`` is for views without units or names of their own.

    Raises StudyNotFoundError. A figure that cannot be drawn says why.
    """
    found = []
    for saved in store.views.all(study_id):
        if saved.place is not None:
            try:
                found.append(_drawn(store, study_id, saved.view, choice))
            except SelectionError as error:
                why = _("The figure {name} cannot be drawn: {why}.", name=saved.view.name, why=str(error))
                found.append(ChosenFigure(saved.view.name, why))
    return tuple(found)


def figure_query(study: Study, view: View) -> CurveQuery | MapQuery:
    """What a view shows; raises SelectionError."""
    find = map_query if view.page == "map" else curve_query
    query = find(study, Address(view.query))
    if query is None:
        raise refused(
            "page", "nothing-varies",
            "needs a study in which two parameters vary"
            if view.page == "map"
            else "needs a study in which a parameter varies",
            view.page,
        )  # fmt: skip
    return query


def _drawn(store: Store, study_id: str, view: View, choice: Choice) -> ChosenFigure:
    study, given = store.studies.study(study_id), Address(view.query)
    own = Choice(given.get("units") or choice.units, given.get("names") or choice.names)
    reading = reading_for(study, store.studies.spec(study_id), own)
    query = figure_query(study, view)
    if isinstance(query, MapQuery):
        shown = read_map(stored_map(store, study_id, CurveQuery(query.x, (query.z,), (query.y,), query.at)), reading)
        check_size("points", shown.values.size, MAX_PICTURE_POINTS)
        x, y = map(lower_first, shown.names)
        text = _("{z} over {x} and {y}", z=shown.title, x=x, y=y)
        return ChosenFigure(view.name, text, shown, given.get("kind") == CONTOUR, (query.z,))
    curves = drawn_curves(store, study_id, query)
    require_drawable([curves])
    figure = read_figure(curves_figure([("", curves)], _COLUMNS), reading)
    return ChosenFigure(view.name, caption(study, query).said(reading), figure, results=query.y)
