"""Calibration: which parameters are unknown, and what was measured (`calibrate` of a spec)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Amount, Sentence, plural
from sprag_study.service.languages import N_
from sprag_study.service.reading.limits import number_in, quoted
from sprag_study.service.reading.texts import quantity_text
from sprag_study.service.reading.units import parse_quantity
from sprag_study.service.spec.axes.axes import PATHS, check_paths
from sprag_study.service.spec.described import Described, Listed, Record, Variants, choice, named
from sprag_study.service.spec.fields import expanded
from sprag_study.service.spec.kinds.draft import Kind
from sprag_study.service.spec.kinds.fields import RESULT, read_ends, read_path_of, read_result
from sprag_study.service.spec.kinds.measured_points import MeasuredTable, read_results, read_table
from sprag_study.service.spec.lists import refuse_mixed
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.schema.quantity import QUANTITY
from sprag_study.service.spec.shares import in_percent
from sprag_study.worker.errors import WrongPlanError
from sprag_study.worker.planning.calibrate.plan import (
    LOSSES,
    MOST_MEASURED,
    MOST_SENSORS,
    MOST_UNKNOWN,
    REFITS,
    CalibratePlan,
    Sensor,
    Unknown,
)

if TYPE_CHECKING:
    from sprag_study.service.spec.kinds.draft import Draft, Finish

_CSV: Final = (
    "text of a CSV file: a column for each parameter that was set, for each measured result and, behind it, for its "
    "standard deviation (sigma); units in brackets"
)
_LOSS: Final = "how much a large residual counts: linear (least squares), or less with the others"
_OUTLIERS: Final = {
    "linear": "count fully (least squares)", "soft_l1": "count less (soft_l1)", "huber": "count less (huber)",
    "cauchy": "hardly count (cauchy)",
}  # fmt: skip
_REFITS: Final = "refits of the bootstrap, which gives the intervals; 0 for none"
_GAIN: Final = "how many times the modelled value the sensor reads: a number, or from .. to where it is fitted too"
_OFFSET: Final = "what the sensor reads at a modelled value of 0: a quantity, or from .. to where it is fitted too"
_RANGE: Final = Record({"from": QUANTITY, "to": QUANTITY}, required=("from", "to"))
#: Gains of sensors.
_GAINS: Final = (0.01, 100.0)
_SENSOR: Final = Record(
    {"result": RESULT, "gain": Variants([QUANTITY, _RANGE], _GAIN), "offset": Variants([QUANTITY, _RANGE], _OFFSET)},
    required=("result",),
    some=("gain", "offset"),
)
_SENSORS: Final = Listed(
    "sensors", 1, MOST_SENSORS, "gain and offset of sensors, each of a measured result; others read it as it is",
    item=_SENSOR,
)  # fmt: skip
_SIGMA: Final = N_('its standard deviation: a quantity, or a share of the mean, as in "20 %"')
_PRIOR: Final = Record(
    {"mean": QUANTITY, "sigma": {**QUANTITY, "description": _SIGMA, "examples": ["0.002 N*m*s/rad", "20 %"]}},
    "what is known of it before the measurement: a normal distribution, which counts as one more measured value",
    required=("mean", "sigma"),
)
_UNKNOWN: Final = Record(
    {"path": PATHS, "from": QUANTITY, "to": QUANTITY, "prior": _PRIOR}, required=("path", "from", "to")
)
_MEASURED: Final = Record({"csv": {"type": "string", "description": _CSV}}, required=("csv",))
CALIBRATE: Final = Record(
    {
        "unknown": Listed("parameters", 1, MOST_UNKNOWN, "what is unknown, each between two values", item=_UNKNOWN),
        "measured": _MEASURED,
        "sensors": _SENSORS,
        **named(
            choice("loss", _LOSS, *LOSSES, default="linear", label="Outliers", called=_OUTLIERS),
            Described("refits", "Refits", _REFITS, "whole", *REFITS, 200),
            Described("seed", "Seed", "seed of the random numbers", "whole", 0, 2**32 - 1, 1),
        ),
    },
    "measured points, and the parameters that they are to determine",
    required=("unknown", "measured"),
)


def _read(draft: Draft) -> Finish | None:
    node = draft.spec["calibrate"]
    if not CALIBRATE.read(node, null=False):
        return None
    unknown = _read_unknown(node)
    measured = node["measured"]
    table = read_table(measured["csv"]) if _MEASURED.read(measured) else None
    other = CALIBRATE.values(node)
    for index, one in enumerate(unknown or ()):
        for path in set(one.paths) & set(table.paths if table else ()):
            node["unknown"][index]["path"].refuse("conflict", "is a column of the measured points", path,
                                                  allowed="either unknown, or set in the measurement")  # fmt: skip
    if not node.sound or not unknown or table is None:
        return None
    columns = zip(table.paths, zip(*table.conditions, strict=True), strict=True)
    draft.vary([*((one.paths, (one.low, one.high)) for one in unknown), *(((path,), own) for path, own in columns)])

    def make_plan() -> None:
        draft.plan = _read_plan(node, unknown, table, **other)

    return make_plan


#: The values of parameters from measured points.
CALIBRATION: Final = Kind({"calibrate": CALIBRATE}, _read)


def _read_unknown(calibrate: Node) -> tuple[Unknown, ...] | None:
    node = calibrate["unknown"]
    unknown: list[Unknown] = []
    for item in CALIBRATE.items(calibrate, "unknown"):
        if _UNKNOWN.read(item):
            path = item["path"]
            paths = read_path_of(path.holding(_expanded(path)))
            ends = None if paths is None else read_ends(item, paths, (item["from"], item["to"]))
            if paths is not None and ends is not None:
                unknown.append(Unknown(paths, *ends, _read_prior(item["prior"], paths, ends)))
    if node.sound:
        check_paths(node.report, [one.paths for one in unknown], node.pointer)
    return tuple(unknown) if node.sound else None


def _read_prior(node: Node, paths: Sequence[str], ends: tuple[float, float]) -> tuple[float, float] | None:
    """Mean and standard deviation in SI; None where there is no prior, or faults are recorded."""
    if not node.given or not _PRIOR.read(node):
        return None
    parameters, (low, high) = [node.machine.parameters[path] for path in paths], ends
    unit, share = parameters[0].unit, in_percent(node["sigma"].value)
    mean = node["mean"].number_in(parameters)
    if share is None:
        sigma = node["sigma"].parsed(lambda given: parse_quantity(given, unit), allowed=_SIGMA, unit=unit)
    else:
        sigma = None if mean is None else share * abs(mean)
    if mean is not None and not low <= mean <= high:
        span = Sentence("{low} to {high}", low=Amount(low, unit, digits=6), high=Amount(high, unit, digits=6))
        node["mean"].refuse("out-of-range", "lies outside of the range of the parameter", allowed=span)
    most = Sentence("above 0, at most {high}", high=Amount(high - low, unit, digits=6))
    if share and mean == 0.0:
        node["sigma"].refuse("out-of-range", "is a share of a mean of 0", allowed=most)
    elif sigma is not None and sigma <= 0.0:
        node["sigma"].refuse("out-of-range", "is out of range", allowed=most)
    elif sigma is not None and sigma > high - low:
        node["sigma"].refuse("out-of-range", "is more than the width of the range; was it in percent?", allowed=most)
    return None if mean is None or sigma is None else (mean, sigma)


def _expanded(node: Node) -> object:
    """The path or paths with every ``*`` replaced by the numbers that there are; unchanged where there are none."""
    path, known = node.value, node.machine.parameters
    items: list[Any] = path if isinstance(path, list) else [path]
    every = [expanded(item, known) if isinstance(item, str) and "*" in item else [item] for item in items]
    changed = all(every) and any(own != [item] for own, item in zip(every, items, strict=True))
    return [each for own in every for each in own] if changed else path


def _read_plan(
    node: Node, unknown: tuple[Unknown, ...], table: MeasuredTable, loss: Any, refits: int, seed: int
) -> dict[str, Any] | None:
    """The plan as plain JSON data; None, and the faults recorded, where the measured results are invalid."""
    text = node["measured"]["csv"]
    measured = read_results(text, table)
    if measured is None:
        return None
    sensors = _read_sensors(node, [one.result for one in measured])
    if sensors is None:
        return None
    fitted = len(unknown) + sum(len(one.unknown) for one in sensors)
    least = max(1, fitted + 1 - sum(one.prior is not None for one in unknown))
    count = sum(len(one.values) for one in measured)
    if not least <= count <= MOST_MEASURED:
        text.refuse(
            "out-of-range", plural("has {count} measured value", "has {count} measured values", count), count,
            allowed=Sentence(
                "{low} to {high}: more values than numbers to fit", low=str(least), high=MOST_MEASURED
            ),
        )  # fmt: skip
        return None
    try:
        plan = CalibratePlan(unknown, table.paths, table.conditions, measured, loss, refits, seed, sensors)
        return plan.to_json()
    except WrongPlanError as error:
        text.refuse("too-many", error.message, None, allowed="fewer different points or unknown parameters")
        return None


def _read_sensors(calibrate: Node, measured: list[str]) -> tuple[Sensor, ...] | None:
    """Gains and offsets of the measured results; None, and the faults recorded, where they are invalid."""
    if not calibrate["sensors"].given:
        return ()
    before, sensors = calibrate.report.found, list[Sensor]()
    for item in CALIBRATE.items(calibrate, "sensors"):
        if not _SENSOR.read(item):
            continue
        info = read_result(item["result"])
        if info is None:
            continue
        if info.name not in measured:
            item["result"].refuse("conflict", "is not a measured result", allowed=quoted(measured))
        if any(one.result == info.name for one in sensors):
            item["result"].refuse("repeated", "names the same result twice", allowed="each once")
        if not item["gain"].given and not item["offset"].given:
            item.refuse("required", "has neither a gain nor an offset", None, allowed="one of them, or both")
        gain, offset = _read_factor(item["gain"], "1", 1.0), _read_factor(item["offset"], info.unit, 0.0)
        if gain is not None and not _GAINS[0] <= gain[0] <= gain[1] <= _GAINS[1]:
            low, high = (Amount(end) for end in _GAINS)
            item["gain"].refuse(
                "out-of-range", "is out of range", allowed=Sentence("{low} to {high}", low=low, high=high)
            )
        if gain is not None and offset is not None:
            sensors.append(Sensor(info.name, gain, offset))
    return None if calibrate.report.found > before else tuple(sensors)


def _read_factor(node: Node, unit: str, default: float) -> tuple[float, float] | None:
    """The ends of a gain or an offset in SI, equal where it is given; None, and a fault recorded, where it is none."""
    if not node.given:
        return default, default
    such = Sentence("{number}, or such a range from .. to", number=number_in(unit))
    if not isinstance(node.value, Mapping):
        value = node.parsed(lambda given: parse_quantity(given, unit), allowed=such, unit=unit)
        return None if value is None else (value, value)
    if not _RANGE.read(node) or refuse_mixed([node["from"], node["to"]], unit):
        return None
    ends = [
        node[name].parsed(lambda given: parse_quantity(given, unit), allowed=number_in(unit), unit=unit)
        for name in ("from", "to")
    ]
    known = sorted(end for end in ends if end is not None)
    if len(known) == 2 and known[0] == known[1]:
        node.refuse("invalid-range", "begins where it ends", quantity_text(known[0], unit), allowed="two values")
        return None
    return (known[0], known[1]) if len(known) == 2 else None
