"""The tolerances of a spec: which parameters differ from drive to drive, and the draws of the drives."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Amount, Place, Sentence
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import range_sentence
from sprag_study.service.reading.limits import unit_list
from sprag_study.service.reading.together import AMBIGUOUS_UNIT, question
from sprag_study.service.spec.described import Described, Field, Listed, Record, choice, named
from sprag_study.service.spec.draws.correlations import CORRELATIONS, read_correlations
from sprag_study.service.spec.draws.described import DISTRIBUTION, FIELDS, read_measured, read_plus_minus
from sprag_study.service.spec.draws.distributions import Distribution
from sprag_study.service.spec.draws.unit import correlated, unit_sample
from sprag_study.service.spec.fields import base_pointer, expanded
from sprag_study.service.spec.kinds.draft import Kind
from sprag_study.service.spec.node import Node
from sprag_study.worker.derived import blocks, involved
from sprag_study.worker.limits import MAX_AXIS_VALUES, MAX_CASES, MAX_DRIVES, MAX_TOLERANCES
from sprag_study.worker.models.parameters import in_range, parameter_of
from sprag_study.worker.spread import DRIVE, Spread, Tolerance
from sprag_study.worker.study import Axis

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sprag_study.service.spec.kinds.draft import Draft, Finish
    from sprag_study.service.spec.report import Report
    from sprag_study.worker.models import Parameter
    from sprag_study.worker.study import Study

_PATH: Final = {"type": "string", "examples": ["pendulums.*.backlash", "shaft.load"]}
_SHARED: Final = Described("shared", "", "whether all its parameters share one draw", "flag", default=False)
_TOLERANCE: Final = Record(
    {
        "path": {
            "anyOf": [_PATH, {"type": "array", "items": _PATH, "minItems": 1}],
            "description": "what differs from drive to drive; `*` stands for every pendulum or step",
        },
        **FIELDS,
        "shared": _SHARED,
    },
    required=("path",),
)
_TOLERANCES: Final = Listed(
    "tolerances", 1, MAX_TOLERANCES, "what differs from one built drive to the next, and by how much", item=_TOLERANCE
)
DRAWS: Final = named(
    Described("drives", "", "drives that are drawn; the nominal one is added to them", "whole", 1, MAX_DRIVES, 256),
    Described("seed", "", "seed of the random numbers of the drives", "whole", 0, 2**32 - 1, 1),
    choice(
        "draws", "how drives are drawn: sobol (scrambled) and latin_hypercube fill the distributions evenly, random "
        "draws are independent", "sobol", "latin_hypercube", "random", default="sobol",
    ),
)  # fmt: skip
#: The fields of a spec about tolerances.
SPREAD: Final[dict[str, Field]] = {"tolerances": _TOLERANCES, **DRAWS, "correlations": CORRELATIONS}
#: What is added to the seed for the numbers of fresh drives.
_FRESH: Final = 1
#: Probability outside the range of a parameter from which on its cut is reported.
_CUT: Final = 1e-3


@dataclass(frozen=True)
class _Drawn:
    """A tolerance with its distribution; ``item`` is where the spec describes it."""

    item: Node
    tolerance: Tolerance
    distribution: Distribution


@dataclass(frozen=True)
class _Nominal:
    """Nominal values (SI) that a parameter has in the study."""

    parameter: Parameter
    values: NDArray[np.float64]
    varies: bool


def _read(draft: Draft) -> Finish | None:
    draft.spread = _read_spread(draft.spec, draft.axes, draft.fresh)
    node = draft.spec["tolerances"]
    if node.given and draft.kind in {"refine", "calibrate"} and draft.axes is not None:
        node.refuse("conflict", "cannot be combined with `refine` or `calibrate`", None,
                    allowed="`goal`, or plain axes")  # fmt: skip
    # A search draws the drives of each design itself.
    return None if draft.spread is None or draft.kind else partial(_run_drives, draft, draft.spread)


#: Studies of drives as they are built.
DRIVES: Final = Kind(SPREAD, _read, chooses=True)


def _read_spread(spec: Node, axes: Sequence[Axis] | None, fresh: int) -> Spread | None:
    """The tolerances of a spec and the draws of its drives; None without, or, with the faults recorded, if invalid.

    ``axes`` are those of the study without drives (of a study that chooses its own cases, the ends of what it may
    choose); None where they could not be read. ``fresh`` drives are drawn beside those that the spec asks for.
    """
    node = spec["tolerances"]
    if not node.given:
        spec.refuse_each(SPREAD, "has no effect without `tolerances`", "not-used")
        return None
    settings = {name: field.read(spec) for name, field in DRAWS.items()}
    items = _TOLERANCES.read(node)
    drawn = [one for item in items or () for one in _read_item(item, axes or ())]
    _check_once(drawn)
    names = {path: k for k, one in enumerate(drawn) for path in one.tolerance.paths}
    matrix, pairs = read_correlations(spec["correlations"], names, len(drawn))
    if not node.sound or axes is None or items is None:
        return None
    drives = settings["drives"]
    if len(drawn) > MAX_TOLERANCES or drives * len(drawn) > MAX_AXIS_VALUES:
        spec["drives"].refuse(
            "too-many",
            Sentence("asks for {draws} draws of {tolerances} tolerances", draws=drives, tolerances=len(drawn)),
            drives,
            allowed=Sentence(
                "at most {draws} draws and {tolerances} tolerances together",
                draws=MAX_AXIS_VALUES, tolerances=MAX_TOLERANCES,
            ),
        )  # fmt: skip
        return None
    room = MAX_AXIS_VALUES // len(drawn) - drives
    node = spec["goal"]["fresh_drives"]
    if fresh > room and node.given:
        message = Sentence("asks for {draws} draws of {tolerances} tolerances", draws=fresh, tolerances=len(drawn))
        node.refuse("too-many", message, fresh, allowed=Sentence("at most {drives} drives", drives=room))
        return None
    fresh = min(fresh, room)
    for one in drawn:
        _warn_of_cut(one)
    unit = unit_sample(settings["draws"], drives, settings["seed"], len(drawn))
    if fresh:
        # Independent of each other, as intervals assume, and of the drives of the search.
        unit = np.concatenate([unit, np.random.default_rng((settings["seed"], _FRESH)).random((fresh, len(drawn)))])
    unit = correlated(unit, matrix)
    columns = [one.distribution.quantile(unit[:, k]) for k, one in enumerate(drawn)]
    about = {"seed": settings["seed"], "draws": settings["draws"], "correlations": pairs}
    return Spread([one.tolerance for one in drawn], np.stack(columns, axis=1), about, fresh)


def _run_drives(draft: Draft, spread: Spread) -> None:
    """Run each case in every drive; SpecError where there are too many."""
    axes, places = draft.axes or (), draft.cases
    if not axes:
        draft.combine = "grid"
    drives = np.arange(spread.drives + 1, dtype=np.float64)
    cases = places * drives.size
    if draft.combine == "zip" and cases * (len(axes) + 1) > MAX_AXIS_VALUES:
        most = MAX_AXIS_VALUES // (places * (len(axes) + 1)) - 1
        allowed = Sentence("at most {drives} drives of this table; a plain grid may have more", drives=most)
    elif cases > MAX_CASES or sum(map(len, axes)) + drives.size > MAX_AXIS_VALUES:
        allowed = Sentence("at most {drives} drives", drives=MAX_CASES // places - 1)
    elif draft.combine == "grid":
        draft.axes = (*axes, Axis((DRIVE,), drives))
        return
    else:
        repeated = [Axis(axis.paths, np.repeat(axis.array, drives.size)) for axis in axes]
        draft.axes = (*repeated, Axis((DRIVE,), np.tile(drives, places)))
        return
    message = Sentence(
        "asks for {cases} cases: {places} with the nominal drive and {drives} drawn ones each",
        cases=cases, places=places, drives=spread.drives,
    )  # fmt: skip
    node = draft.spec["drives"]
    node.refuse("too-many", message, spread.drives, allowed=allowed)
    node.report.raise_if_any()


def warn_of_invalid_drives(report: Report, study: Study) -> None:
    """Warn of derived parameters that are out of range in some drives: those drives fail."""
    for path in study.derive if study.spread is not None and study.plan is None else ():
        part, entry = involved(study, [path]), parameter_of(study, path)
        if entry is None or part.spread is None:
            continue
        wrong = sum(int((~in_range(part.columns(cases)[path], entry)).sum()) for cases in blocks(part))
        if wrong:
            each = study.cases // part.cases
            report.warn(
                "invalid-drives",
                Place("/derive", path),
                Sentence(
                    "is out of its range ({range}) in {wrong} of {cases} cases: these drives fail",
                    range=range_sentence(entry),
                    wrong=wrong * each,
                    cases=study.cases,
                ),
            )


def _read_item(item: Node, axes: Sequence[Axis]) -> list[_Drawn]:
    if not _TOLERANCE.read(item):
        return []
    shared, kind, paths = _SHARED.read(item), DISTRIBUTION.read(item), _read_paths(item["path"])
    if paths is None or shared is None or kind is None:
        return []
    groups = [tuple(paths)] if shared else [(path,) for path in paths]
    path = item["path"].value
    given = path if isinstance(path, str) else " = ".join(path)
    drawn = []
    for group in groups:
        nominal = [_nominal(item, path, axes) for path in group]
        name = given if len(group) > 1 else group[0]
        if "values" in item:
            drawn += _measured(item, name, group, nominal)
        else:
            drawn += _around(item, str(kind), name, group, nominal)
    return drawn


def _read_paths(node: Node) -> list[str] | None:
    """The parameters of an item; None, and faults recorded, where one is unknown or derived."""
    machine = node.machine
    items = node.value if isinstance(node.value, list) else [node.value]
    names = [item for item in items if isinstance(item, str)]
    allowed = N_("a path such as 'pendulums.*.backlash', or a list of paths; `*` stands for every pendulum or step")
    if not items or len(names) < len(items):
        node.mistake("must be a path, as text", allowed=allowed)
        return None
    paths: list[str] = []
    for item in names:
        known = expanded(item, machine.parameters)
        paths += known
        if not known and not machine.assumed(item):
            node.refuse("invalid-path", machine.why_not(item), item, allowed=allowed)
        for path in known:
            if path in machine.derive:
                message = Sentence("{path} is derived from other parameters, whose tolerances it has", path=path)
                node.refuse("conflict", message, item, allowed="a path without a formula in `derive`")
    return paths if node.sound else None


def _nominal(item: Node, path: str, axes: Sequence[Axis]) -> _Nominal:
    machine = item.machine
    axis = next((axis for axis in axes if path in axis.paths), None)
    base = [machine.values[path]] if path in machine.values else []
    values = np.array(base, dtype=np.float64) if axis is None else axis.array
    return _Nominal(machine.parameters[path], values, axis is not None)


def _measured(item: Node, name: str, paths: tuple[str, ...], nominal: list[_Nominal]) -> list[_Drawn]:
    """A tolerance given by measured values."""
    item.refuse_each(("plus_minus", "distribution"), "cannot be combined with `values`")
    varied = [path for path, one in zip(paths, nominal, strict=True) if one.varies]
    if varied:
        message = Sentence("gives {path} its values, but an axis varies it", path=varied[0])
        item["values"].refuse("conflict", message, None,
                              allowed="plus_minus, which changes the values of the axis")  # fmt: skip
    values = read_measured(item["values"], [one.parameter for one in nominal])
    if values is None:
        return []
    about = {"distribution": "values", "values": len(values)}
    return [_Drawn(item, Tolerance(name, paths, "value", about), Distribution("values", values=tuple(values)))]


def _mixed(node: Node, nominal: list[_Nominal]) -> bool:
    """Whether a bare distance stands beside a nominal value in a unit of another scale; it is recorded as a fault."""
    written = [node.report.written(base_pointer(one.parameter.path)) for one in nominal]
    texts = [value for value in written if isinstance(value, str)]
    unit = nominal[0].parameter.unit
    asked = question([node.value, *texts], unit) if not isinstance(node.value, str) else None
    if asked is None or asked.place:
        return False
    node.refuse(AMBIGUOUS_UNIT, asked.message, allowed=asked.allowed, unit=unit)
    return True


def _around(item: Node, kind: str, name: str, paths: tuple[str, ...], nominal: list[_Nominal]) -> list[_Drawn]:
    """A tolerance around the nominal values."""
    node = item["plus_minus"]
    if _mixed(node, nominal):
        return []
    units = list(dict.fromkeys(one.parameter.unit for one in nominal))
    read = read_plus_minus(item, nominal[0].parameter, kind)
    if read is None:
        return []
    share, middle, half = read.share, read.middle, read.half
    if not share and len(units) > 1:
        message = Sentence("is shared by parameters of different units: {units}", units=unit_list(units))
        node.refuse("wrong-unit", message, allowed='a share, as in "5 %"')
        return []
    if any(not one.values.size for one in nominal):
        item["path"].refuse("required", Sentence("{path} has no nominal value in `base`", path=name))
        return []
    values = np.unique(np.concatenate([one.values for one in nominal]))
    if kind == "lognormal":
        if values[0] <= 0.0 or (not share and values.size > 1):
            item["distribution"].refuse(
                "out-of-range",
                "a lognormal distribution needs a nominal value above 0, and a share where there are several",
                allowed="another distribution",
            )
            return []
        share, half = True, half if share else half / float(values[0])
    if share and not values.any():
        message = Sentence("is a share of the nominal value of {path}, which is 0", path=name)
        node.refuse("out-of-range", message, allowed="a quantity", unit=units[0])
        return []
    low, high = _range(nominal, share=share)
    distribution = Distribution(kind, middle + (1.0 if share else 0.0), half, low=low, high=high)  # type: ignore[arg-type]
    about = {"distribution": kind, "plus_minus": read.written}
    return [_Drawn(item, Tolerance(name, paths, "scale" if share else "offset", about), distribution)]


def _range(nominal: list[_Nominal], *, share: bool) -> tuple[float, float]:
    """The least and the largest factor or offset with which no nominal value leaves the range of its parameter."""
    low, high = -math.inf, math.inf
    for one in nominal:
        least = math.nextafter(one.parameter.low, math.inf) if one.parameter.low_open else one.parameter.low
        signs = (one.values[one.values > 0.0], one.values[one.values < 0.0]) if share else (one.values,)
        for value in (end for part in signs if part.size for end in (float(part.min()), float(part.max()))):
            ends = [(end / value if share else end - value) for end in (least, one.parameter.high)]
            below, above = sorted(ends)
            # One step inwards: the product or the sum is rounded.
            low = max(low, below if math.isinf(below) or below == 0.0 else math.nextafter(below, math.inf))
            high = min(high, above if math.isinf(above) else math.nextafter(above, -math.inf))
    return low, max(high, low)


def _check_once(drawn: Sequence[_Drawn]) -> None:
    counts = Counter(path for one in drawn for path in one.tolerance.paths)
    for one in drawn:
        again = [path for path in one.tolerance.paths if counts[path] > 1]
        if again:
            one.item["path"].refuse("repeated", "has two tolerances", again[0], allowed="each parameter once")


def _warn_of_cut(one: _Drawn) -> None:
    outside = one.distribution.outside
    if outside > _CUT:
        text = Sentence(
            "{outside} of the distribution lies outside the range of the parameter; it is left out, and the rest is "
            "drawn",
            outside=Amount(outside, digits=2),
        )
        one.item.report.warn("tolerance-cut", Place(one.item.pointer, one.tolerance.name), text)
