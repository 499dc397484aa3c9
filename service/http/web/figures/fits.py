"""The fits of measured clutches of a spec: each a report and a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sprag_study.service.http.web.figures.fit import FitChart, fit_chart
from sprag_study.service.reading.units import QuantityError, parse_quantity
from sprag_study.service.results.fits import fit_json
from sprag_study.service.spec.derive import with_values
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.fields import base_path
from sprag_study.service.spec.machine.clutch import read_clutch
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report
from sprag_study.service.spec.stored import accepted

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag_study.service.answers.studies import ClutchFitReport
    from sprag_study.worker.models import ClutchFit
    from sprag_study.worker.study import Study

    Fitted = tuple[ClutchFitReport, FitChart]

__all__ = ["FitChart", "fit_at", "fits_of", "has_measured_clutch"]


def fit_at(spec: Mapping[str, Any], study: Study | None, pointer: str) -> Fitted | None:
    """The fit of the measured clutch at a JSON Pointer, whatever else is wrong with the spec (then without ``study``);
    None where the data cannot be fitted.
    """
    clutch = _clutch_at(spec, pointer)
    if not clutch.get("data") or "accuracy" not in clutch:
        return None
    known = _backlashes(spec if study is None else _with_derived(spec, study), pointer)
    prefix = base_path(pointer) + "."
    read = read_clutch(Node(Report(), pointer, clutch), prefix, known)
    return None if read is None or read.fit is None else _fitted(read.fit, clutch, known)


def fits_of(spec: dict[str, Any], study: Study) -> dict[str, Fitted]:
    """Report and picture of each clutch law that the spec of a ``study`` gives as measured data, by JSON Pointer."""
    # The fit is not stored, because it follows from the spec exactly.
    spec = accepted(spec, study)
    alone = {key: value for key, value in spec.items() if key in ("sprag", "model", "name", "base", "derive", "run")}
    parsed = parse_spec(alone)
    given = _with_derived(spec, parsed.study)
    return {
        pointer: _fitted(fit, _clutch_at(spec, pointer), _backlashes(given, pointer))
        for pointer, fit in parsed.fits.items()
    }


def has_measured_clutch(spec: Mapping[str, Any]) -> bool:
    """Whether any clutch of a spec is given as measured data."""
    base = spec.get("base", {})
    pendulums = base.get("pendulums")
    clutches = [base.get("clutch"), *(item.get("clutch") for item in pendulums or () if isinstance(item, dict))]
    return any(isinstance(clutch, dict) and "data" in clutch for clutch in clutches)


def _fitted(fit: ClutchFit, clutch: Mapping[str, Any], backlashes: list[float]) -> Fitted:
    return fit_json(fit), fit_chart(fit, clutch, backlashes[0] if backlashes else 0.0)


def _backlashes(spec: Mapping[str, Any], pointer: str) -> list[float]:
    """Backlash (rad) of every pendulum that has the clutch at ``pointer``, as far as they can be read."""
    pendulums = spec["base"].get("pendulums", [])
    own = pointer.split("/")
    found = []
    for item in [pendulums[int(own[3])]] if len(own) > 4 else pendulums:
        try:
            found.append(parse_quantity(item.get("backlash", 0.0), "rad"))
        except QuantityError:
            continue
    return found


def _clutch_at(spec: Mapping[str, Any], pointer: str) -> dict[str, Any]:
    """The clutch at a JSON Pointer of a spec."""
    parts, base = pointer.split("/"), spec["base"]
    found: dict[str, Any] = base["clutch"] if len(parts) == 3 else base["pendulums"][int(parts[3])]["clutch"]
    return found


def _with_derived(spec: Mapping[str, Any], study: Study) -> dict[str, Any]:
    """The spec with the values of derived parameters in its base."""
    return {**spec, "base": with_values(spec["base"], {path: study.base[path] for path in study.derive})}
