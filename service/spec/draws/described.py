"""The fields by which a spec describes a distribution: shared by tolerances and samples."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from sprag.sentences import Amount, Sentence
from sprag.service.languages import N_
from sprag.service.reading.together import split_list
from sprag.service.reading.units import QuantityError, parse_quantity
from sprag.service.spec.described import Described, Listed, choice, named
from sprag.service.spec.draws.distributions import SIGMAS
from sprag.service.spec.fields import read_number
from sprag.service.spec.lists import read_list, read_list_text
from sprag.service.spec.report import Report, join
from sprag.service.spec.shares import in_percent
from sprag.worker.limits import MAX_CORRELATIONS, MAX_DRIVES, MAX_TOLERANCES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.worker.models import Parameter

DISTRIBUTION: Final = choice(
    "distribution",
    f"normal: plus_minus is {SIGMAS:g} standard deviations; truncated_normal: the same without what lies beyond "
    "plus_minus; lognormal: the logarithm is normal and the nominal value the median; uniform and triangular: from "
    "-plus_minus to +plus_minus",
    "normal", "truncated_normal", "lognormal", "uniform", "triangular", default="normal",
)  # fmt: skip
PLUS_MINUS: Final = Described(
    "plus_minus", "", "how far the value lies from the nominal one", "text",
    limits=N_('a share of the nominal value, as in "5 %", or a quantity, as in "0.2 mm"'),
)  # fmt: skip
MEASURED: Final = Listed("values", 1, 100_000, "measured values, each of which is drawn equally often")
SHARED: Final = Described("shared", "", "whether all its parameters share one draw", "flag", default=False)
TOLERANCES: Final = Listed(
    "tolerances", 1, MAX_TOLERANCES, "what differs from one built drive to the next, and by how much"
)
DRAWS: Final = named(
    Described("drives", "", "drives that are drawn; the nominal one is added to them", "whole", 1, MAX_DRIVES, 256),
    Described("seed", "", "seed of the random numbers of the drives", "whole", 0, 2**32 - 1, 1),
    choice(
        "draws", "how drives are drawn: sobol (scrambled) and latin_hypercube fill the distributions evenly, random "
        "draws are independent", "sobol", "latin_hypercube", "random", default="sobol",
    ),
)  # fmt: skip
CORRELATIONS: Final = Listed("correlations", 0, MAX_CORRELATIONS, "parameters whose draws depend on each other")
COEFFICIENT: Final = Described("coefficient", "", "correlation of the normal scores", "number", -1.0, 1.0)

#: Range of a share that `plus_minus` may be.
_LEAST: Final = 1e-9
_MOST: Final = 10.0
#: Largest number that it may be of a parameter without bounds.
_LARGEST: Final = 1e100


def read_plus_minus(
    report: Report, pointer: str, data: Mapping[str, Any], parameter: Parameter
) -> tuple[bool, float] | None:
    """Whether `plus_minus` is a share, and its number (of a quantity in SI); None, and a fault recorded, if invalid."""
    where, value = join(pointer, "plus_minus"), data.get("plus_minus")
    if "plus_minus" not in data:
        report.fault(where, "required", "is required, or `values`", allowed=PLUS_MINUS.limits)
        return None
    share = in_percent(value)
    if share is not None:
        if not _LEAST <= share <= _MOST:
            allowed = Sentence(
                "{low} % to {high} %", low=Amount(100 * _LEAST, digits=6), high=Amount(100 * _MOST, digits=6)
            )
            report.fault(where, "out-of-range", "is out of range", value, allowed=allowed)
            return None
        return True, share
    try:
        number = parse_quantity(value, parameter.unit)
    except QuantityError as error:
        report.fault(where, error.code, error.message, value, allowed=PLUS_MINUS.limits, unit=parameter.unit)
        return None
    most = min(parameter.high - parameter.low, _LARGEST)
    if not 0.0 < number <= most:
        allowed = Sentence("above 0, at most {high}", high=Amount(most, digits=6))
        report.fault(where, "out-of-range", "is out of range", value, allowed=allowed, unit=parameter.unit)
        return None
    return False, number


def read_measured(report: Report, pointer: str, data: object, parameters: Sequence[Parameter]) -> list[float] | None:
    """Measured values (SI), a list or one text with all of them, in the range of every one of ``parameters``.

    None, and faults recorded, where they are invalid.
    """
    unit = parameters[0].unit
    listed = MEASURED.read(report, pointer, split_list(data) if isinstance(data, str) else data)
    if listed is None:
        return None
    if isinstance(data, str):
        items = read_list_text(report, pointer, data, unit, parameters[0].path)
    else:
        items = read_list(
            report, [(join(pointer, index), item) for index, item in enumerate(listed)], unit, parameters[0].path
        )
    if items is None:
        return None
    places = [pointer if isinstance(data, str) else join(pointer, index) for index in range(len(items))]
    read = [
        [read_number(report, place, item, parameter) for parameter in parameters]
        for place, item in zip(places, items, strict=True)
    ]
    values = [numbers[0] for numbers in read if None not in numbers]
    return [value for value in values if value is not None] if len(values) == len(items) else None
