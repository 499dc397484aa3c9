"""Studies of cases of another study: of one with its values in the base, alone or over a range of one parameter; of
several as points.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.quantities import typed_units, units_in
from sprag_study.service.reading.units import QuantityError, exact_quantity
from sprag_study.service.spec.component_axes import component_axes, keeps_components, with_base
from sprag_study.service.spec.derive import with_values
from sprag_study.service.spec.fields import renamed
from sprag_study.service.spec.kinds.registry import without_cases
from sprag_study.service.spec.kinds.tolerances import SPREAD
from sprag_study.worker.models.parameters import parameter_of
from sprag_study.worker.spread import DRIVE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sprag_study.worker.study import Study

#: Values over which a design is run, and how far beyond its own value.
_VALUES: Final = 41
_BEYOND: Final = 2.0


def design_spec(spec: Mapping[str, Any], study: Study, case: int, along: str | None = None) -> dict[str, Any]:
    """The spec of a study of one case.

    Parameters
    ----------
    spec : the study's own spec
    study : the same in SI numbers
    case : number of the case; IndexError when there is none
    along : path of a parameter that the study varies from 0, or a small value where 0 is not allowed, to twice its
        value; by default nothing varies
    """
    # The nominal drive of a design keeps its tolerances; a drawn drive has its own values in the base.
    nominal = not study.case_parameters(case).get(DRIVE)
    named = nominal or keeps_components(study)
    apart = {*study.derive, *study.beside, *(study.component_paths if named else ())}
    values = {path: value for path, value in study.case_parameters(case).items() if path not in apart}
    typed, units = typed_units(study, spec), units_in(spec["base"])

    def text(path: str, value: float) -> float | str:
        return _text(study, path, value, units.get(path, ""), typed)

    base = spec["base"] if named else with_base(spec)["base"]
    made = {
        **without_cases(spec, SPREAD if nominal else ()),
        "name": renamed(spec.get("name", ""), f", design of case {case}"),
        "base": with_values(base, {path: text(path, value) for path, value in values.items()}),
    }
    parts = component_axes(spec, study, [case]) if named else []
    if parts:
        made["axes"] = parts
    if along is not None:
        most = _BEYOND * values.get(along, study.base[along])
        entry = parameter_of(study, along)
        least = 0.0 if entry is None or entry.accepts(0.0) else most / _VALUES
        made["axes"] = [*parts, {"path": along, "linspace": [text(along, least), text(along, most), _VALUES]}]
    return made


def points_spec(spec: Mapping[str, Any], study: Study, cases: Sequence[int]) -> dict[str, Any]:
    """The spec of a study of these cases, in their order: a line of values (SI) for each, equal ones once.

    Derived parameters follow from the others. Of a study of drives with tolerances each case keeps the values of its
    drive. Raises IndexError for numbers of cases that there are not, and ValueError where nothing varies.
    """
    columns = study.columns(cases)
    named = keeps_components(study)
    apart = {*study.derive, *study.beside, *(study.component_paths if named else ())}
    paths = [path for path in study.column_paths if path not in apart]
    kinds = [one.path for one in study.components] if named else []
    if not paths and not kinds:
        raise ValueError("nothing varies")
    heads = [path if (unit := unit_of(study, path)) == "1" else f"{path} [{unit}]" for path in paths]
    rows = zip(*(columns[path].tolist() for path in (*kinds, *paths)), strict=True)
    first = list({row: place for place, row in reversed(list(enumerate(rows)))}.values())[::-1]
    lines = [",".join(repr(float(columns[path][place])) for path in paths) for place in sorted(first)]
    name = renamed(spec.get("name", ""), f", {len(lines)} of its cases")
    axes: list[dict[str, Any]] = [{"points": "\n".join([",".join(heads), *lines])}] if paths else []
    axes += component_axes(spec, study, [cases[place] for place in sorted(first)]) if named else []
    together = {"combine": "zip"} if kinds else {}
    base = {} if named else {"base": with_base(spec)["base"]}
    return {**without_cases(spec), **base, **together, "name": name, "axes": axes}


def _text(study: Study, path: str, value: float, own: str, typed: Mapping[str, str]) -> float | str:
    """The same number in the unit in which the study has this parameter, otherwise others of its kind."""
    unit = unit_of(study, path)
    if unit == "1":
        return value
    try:
        return exact_quantity(value, unit, own or typed.get(unit, unit))
    except QuantityError:
        return f"{value!r} {unit}"
