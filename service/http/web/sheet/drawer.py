"""The drawer of other curves on a sheet: what can be drawn, where its numbers and files are, and how it is saved."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final
from urllib.parse import parse_qsl, urlencode

from starlette.datastructures import QueryParams

from sprag_study.service.http import views
from sprag_study.service.http.current import current
from sprag_study.service.http.reading import address_pairs, file_pairs
from sprag_study.service.http.web.saved_views import saved_here
from sprag_study.service.http.web.sheet.chart import CHOICES
from sprag_study.service.languages import N_, _
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.results.choice import map_query, pairs_of
from sprag_study.service.results.defaults import varying_axes
from sprag_study.service.results.refined_maps import map_plan
from sprag_study.service.results.regimes import ORDER
from sprag_study.worker import models
from sprag_study.worker.models.starts import has_starts

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.http.web.sheet.view import Sheet
    from sprag_study.service.storage.saved_views import SavedView
    from sprag_study.worker.study import Study

#: Kinds of map: word on the control.
KINDS: Final = {"heatmap": N_("Colours"), "contour": N_("Lines of equal value")}


def drawer_of(
    study: Study, study_id: str, sheet: Sheet, given: QueryParams, saved: Sequence[SavedView]
) -> dict[str, Any]:
    """What can be drawn, what is, and the addresses of its numbers, files and of a saved view of it."""
    chart, infos, plan = sheet.chart, models.study_results(study), map_plan(study)
    numeric = [info for info in infos if info.kind != "category"]
    kind = given.get("kind") or "heatmap"
    kind = kind if kind in KINDS else "heatmap"
    mapped = map_query(study, QueryParams()) is not None
    found: dict[str, Any] = {
        "asked": bool(sheet.faults) or any(given.get(name) for name in (*CHOICES, "z", "up")),
        "axes": axis_choices(study),
        "results": numeric,
        "mapped": [info for info in numeric if mapped and (plan is None or info.name in plan.results)],
        "results_asked": (),
        "kind": kind,
        "kinds": KINDS,
        "orders": _map_address(study, study_id, ORDER) if models.is_settled(study.run) else None,
        "regime_maps": _regime_maps(study, study_id),
        "files": "",
        "report": [],
        "here_saved": None,
    }
    if chart is None:
        return found
    pairs = parse_qsl(chart.query)
    if chart.map is not None:
        pairs.append(("kind", kind))
    found["files"] = f"{views.study_address(study_id)}/{chart.view}?{urlencode([*pairs, *file_pairs()])}"
    if chart.curves is not None or chart.map is not None:
        query = urlencode([*pairs, *address_pairs(current().choice)])
        found["here_saved"] = saved_here(saved, chart.view, study_id, query, chart.title)
    if chart.curves is not None:
        more = [(name, text) for name in ("point", "curve") if (text := given.get(name))]
        found |= {"results_asked": tuple(given.getlist("y")), "report": [*pairs, *more]}
    return found


def axis_choices(study: Study) -> list[dict[str, Any]]:
    """The axes that can be drawn over."""
    return [
        {"path": axis.paths[0], "paths": axis.paths, "unit": unit_of(study, axis.paths[0]), "values": len(axis)}
        for axis in varying_axes(study)
    ]


def map_pairs(given: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """The parameters of a map on the sheet from those that it has elsewhere, where its axis upwards is ``y``."""
    pairs = [("up" if name == "y" else name, value) for name, value in given]
    return pairs if any(name == "z" for name, _ in pairs) else [*pairs, ("z", "-")]


def with_query(path: str, pairs: Sequence[tuple[str, str]]) -> str:
    """An address with its parameters."""
    return f"{path}?{urlencode(pairs)}" if pairs else path


def _regime_maps(study: Study, study_id: str) -> list[tuple[str, str]]:
    """Text and address of each map of how many motions cases have; none of cases with one start."""
    if not has_starts(study.run):
        return []
    shown = ((N_("number of motions"), "regime.count"), (N_("share of the rarest motion"), "regime.share.least"))
    addresses = [(_(text), _map_address(study, study_id, name)) for text, name in shown]
    return [(text, address) for text, address in addresses if address is not None]


def _map_address(study: Study, study_id: str, z: str) -> str | None:
    """Address of the map of a result; None where no two parameters span one."""
    query = map_query(study, QueryParams({"z": z}))
    if query is None or map_plan(study) is not None:
        return None
    return with_query(f"/studies/{study_id}", map_pairs(pairs_of(query)))
