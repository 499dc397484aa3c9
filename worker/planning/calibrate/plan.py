"""The plan of a calibration: what is unknown, what was measured where, and how closely."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from sprag_study.sentences import Sentence
from sprag_study.worker.errors import WrongPlanError
from sprag_study.worker.limits import MAX_PLANNED_CASES

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Loss = Literal["linear", "soft_l1", "huber", "cauchy"]

#: Value of "kind" in the plan.
CALIBRATE: Final = "calibrate"
LOSSES: Final[tuple[Loss, ...]] = ("linear", "soft_l1", "huber", "cauchy")
#: Bounds of a plan: unknown parameters, measured values, sensors with a gain or an offset, refits of the bootstrap.
MOST_UNKNOWN, MOST_MEASURED, MOST_SENSORS = 12, 2000, 12
REFITS: Final = (0, 1000)
#: Sets of parameters: the scan has `SCAN` for each unknown, at least `LEAST_SCAN`; starts of the fit, their
#: iterations on average, and trials of each refit.
SCAN, LEAST_SCAN, STARTS, ITERATIONS, TRIALS = 24, 48, 4, 40, 10
#: Scans around the fit at most; scans of the ranges at most that begin again because the fit explains the values badly.
SEARCHES, RESTARTS = 3, 3
#: Sets of parameters that are kept for each refit.
REFIT_SETS: Final = 5
#: Iterations of a fit at most, and those that a plan must have room for; fits one after another.
MOST_ITERATIONS, LEAST_ITERATIONS, AGAIN = 100, 8, 24
#: Conditions between and around the measured ones at most, for the fitted curve and the next point.
CURVE: Final = 40
#: Refits that are run there.
CURVES: Final = 100
#: Ranges that span a larger factor are searched logarithmically.
LOGARITHMIC: Final = 10.0


@dataclass(frozen=True, slots=True)
class Unknown:
    """A parameter, or several tied ones, that is to be found between ``low`` and ``high``, SI.

    ``prior`` is what is known of it before the measurement: mean and standard deviation of a normal distribution, SI.
    """

    paths: tuple[str, ...]
    low: float
    high: float
    prior: tuple[float, float] | None = None

    @property
    def logarithmic(self) -> bool:
        """Whether it is searched by its logarithm."""
        return self.low > 0.0 and self.high > LOGARITHMIC * self.low


@dataclass(frozen=True, slots=True)
class Measured:
    """Measured values of one result.

    Attributes
    ----------
    result : str
    at : tuple of int
        Number of the condition of each value.
    values : tuple of float
        SI.
    sigma : tuple of float
        Standard deviation of each value, SI; none where it is not known and follows from the residuals.
    """

    result: str
    at: tuple[int, ...]
    values: tuple[float, ...]
    sigma: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Sensor:
    """What a sensor reads: gain * result + offset, each between two values, SI; equal ends give it."""

    result: str
    gain: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)

    @property
    def unknown(self) -> tuple[Unknown, ...]:
        """Gain and offset, as far as they are unknown."""
        ends = {"gain": self.gain, "offset": self.offset}
        return tuple(Unknown((f"{self.result}.{name}",), *own) for name, own in ends.items() if own[0] < own[1])


@dataclass(frozen=True)
class CalibratePlan:
    """A calibration, in SI.

    Attributes
    ----------
    unknown : tuple of Unknown
    paths_at : tuple of str
        Parameters that the measured conditions vary; may be empty.
    conditions : tuple of tuples of float
        The measured conditions, each once: a value for each of ``paths_at``.
    measured : tuple of Measured
        Each result once.
    loss : {"linear", "soft_l1", "huber", "cauchy"}
    refits : int
        Refits of the bootstrap that give the intervals; 0 for none.
    seed : int
    sensors : tuple of Sensor
        Of results whose measured values are not the modelled ones themselves.

    Raises
    ------
    WrongPlanError
        If a field is out of its range.
    """

    unknown: tuple[Unknown, ...]
    paths_at: tuple[str, ...]
    conditions: tuple[tuple[float, ...], ...]
    measured: tuple[Measured, ...]
    loss: Loss = "linear"
    refits: int = 200
    seed: int = 1
    sensors: tuple[Sensor, ...] = ()

    def __post_init__(self) -> None:
        _check(1 <= len(self.unknown) <= MOST_UNKNOWN, "unknown", len(self.unknown), f"1 to {MOST_UNKNOWN} parameters")
        for i, one in enumerate(self.unknown):
            ends = math.isfinite(one.low) and math.isfinite(one.high) and one.low < one.high
            _check(bool(one.paths) and ends, f"unknown.{i}", (one.low, one.high), "paths, and a range")
            mean, deviation = one.prior or (0.0, 1.0)
            certain = math.isfinite(mean) and 0.0 < deviation < math.inf
            _check(certain, f"unknown.{i}.prior", one.prior, "a finite mean and a positive standard deviation")
        _check_sensors(self)
        _check_measured(self)
        _check(self.loss in LOSSES, "loss", self.loss, ", ".join(LOSSES))
        low, high = REFITS
        _check(low <= self.refits <= high, "refits", self.refits, f"{low} to {high:,}")
        most = MAX_PLANNED_CASES // 2 // (self.least_fit + self.scan)
        different = Sentence("at most {most} different conditions", most=str(most))
        _check(self.fit_sets >= self.least_fit, "measured", len(self.conditions), different)
        _check(0 <= self.seed < 2**63, "seed", self.seed, "an integer of at least 0")
        seen = [path for paths in self.paths for path in paths]
        _check(len(set(seen)) == len(seen), "unknown", seen, "each parameter once, unknown or measured")

    @property
    def fitted(self) -> tuple[Unknown, ...]:
        """Everything that is fitted: the unknown parameters, then gains and offsets, which cost no cases."""
        return (*self.unknown, *(each for one in self.sensors for each in one.unknown))

    def readings(self, results: Floats, values: Floats) -> Floats:
        """Readings of the sensors, shape (sets, conditions, results), of such results and values, (sets, fitted)."""
        read, column = results.copy() if self.sensors else results, len(self.unknown)
        for one in self.sensors:
            factors = []
            for low, high in (one.gain, one.offset):
                factors.append(values[:, column, None] if low < high else low)
                column += low < high
            place = self.results.index(one.result)
            read[:, :, place] = factors[0] * read[:, :, place] + factors[1]
        return read

    @property
    def paths(self) -> tuple[tuple[str, ...], ...]:
        """What each column of the points varies: the unknown parameters, then those of the conditions."""
        return (*(one.paths for one in self.unknown), *((path,) for path in self.paths_at))

    @property
    def results(self) -> tuple[str, ...]:
        """Names of the measured results."""
        return tuple(one.result for one in self.measured)

    @property
    def count(self) -> int:
        """Measured values."""
        return sum(len(one.values) for one in self.measured)

    @property
    def freedom(self) -> int:
        """Degrees of freedom: measured values and priors less unknown parameters, gains and offsets."""
        return self.count + len(self.priors) - len(self.fitted)

    @property
    def scales(self) -> dict[int, int]:
        """Degrees of freedom of each standard deviation that follows from residuals, by the position of its result."""
        left = min(self.freedom / self.count, 1.0)
        return {
            column: max(1, round(left * len(one.values))) for column, one in enumerate(self.measured) if not one.sigma
        }

    @cached_property
    def priors(self) -> Ints:
        """Positions of the unknown parameters that have a prior."""
        return np.array([place for place, one in enumerate(self.unknown) if one.prior is not None], dtype=np.int64)

    @property
    def scan(self) -> int:
        """Sets of parameters of the scan."""
        return max(LEAST_SCAN, SCAN * len(self.unknown))

    @property
    def least_fit(self) -> int:
        """Sets of parameters that a fit must have room for."""
        return STARTS * LEAST_ITERATIONS * (1 + 2 * len(self.unknown))

    @property
    def sets_before_refits(self) -> int:
        """Sets of parameters after which no fit begins again, so that the refits have room."""
        rest = self.most_cases - (1 + CURVES) * CURVE
        return rest // len(self.conditions) - REFIT_SETS * self.refits

    @property
    def fit_sets(self) -> int:
        """Sets of parameters of a fit at most: fewer of a large problem."""
        room = MAX_PLANNED_CASES // 2 // len(self.conditions) - self.scan
        return min(STARTS * ITERATIONS * (1 + 2 * len(self.unknown)), room)

    def places_of(self, sets: int) -> int:
        """Places of a fit that cost so many sets of parameters: differences by gains and offsets cost none."""
        return sets * (1 + 2 * len(self.fitted)) // (1 + 2 * len(self.unknown))

    @property
    def most_cases(self) -> int:
        """Cases of scan, fit, later fits, refits and curve; beyond it the refits end early."""
        scans, fits = (1 + RESTARTS) * (1 + SEARCHES), 3 + RESTARTS
        sets = scans * self.scan + fits * self.fit_sets + self.refits * TRIALS * 3 // 2
        return min(sets * len(self.conditions) + (1 + CURVES) * CURVE, MAX_PLANNED_CASES)

    @property
    def most_rounds(self) -> int:
        """Rounds of the longest course: fits that are scaled and begun again, refits twice."""
        return 3 + AGAIN * MOST_ITERATIONS + 2 * TRIALS

    @cached_property
    def at(self) -> Floats:
        """The measured conditions, shape (conditions, paths_at)."""
        return np.array(self.conditions, dtype=np.float64).reshape(len(self.conditions), len(self.paths_at))

    @cached_property
    def values(self) -> Floats:
        """All measured values, result after result, SI, shape (measured,)."""
        return np.array([value for one in self.measured for value in one.values], dtype=np.float64)

    @cached_property
    def sigma(self) -> Floats:
        """Their standard deviations, SI, shape (measured,); NaN where they are not known."""
        return np.array([s for one in self.measured for s in one.sigma or (math.nan,) * len(one.values)])

    @cached_property
    def places(self) -> tuple[Ints, Ints]:
        """Condition, and position in `results`, of each measured value."""
        conditions = [place for one in self.measured for place in one.at]
        columns = [column for column, one in enumerate(self.measured) for _ in one.values]
        return np.array(conditions, dtype=np.int64), np.array(columns, dtype=np.int64)

    @property
    def known_sigma(self) -> bool:
        """Whether the standard deviation of every value is given."""
        return not bool(np.isnan(self.sigma).any())

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> CalibratePlan:
        """The plan as stored with its study; ValueError as of the class, or if something is missing."""
        try:
            return cls(
                unknown=tuple(
                    Unknown(tuple(map(str, one["paths"])), float(one["low"]), float(one["high"]), _prior(one))
                    for one in data["unknown"]
                ),
                paths_at=tuple(map(str, data["paths_at"])),
                conditions=tuple(tuple(map(float, one)) for one in data["conditions"]),
                measured=tuple(_measured(one) for one in data["measured"]),
                loss=data["loss"],
                refits=int(data["refits"]),
                seed=int(data["seed"]),
                sensors=tuple(_sensor(one) for one in data.get("sensors", ())),
            )
        except KeyError as error:
            raise ValueError(f"calibrate: {error.args[0]} is missing") from error

    def to_json(self) -> dict[str, Any]:
        """The plan as plain JSON data, from which ``from_json`` makes an equal one."""
        return {
            "kind": CALIBRATE,
            "unknown": [
                {"paths": list(one.paths), "low": one.low, "high": one.high}
                | ({"prior": list(one.prior)} if one.prior else {})
                for one in self.unknown
            ],
            "paths_at": list(self.paths_at),
            "conditions": [list(one) for one in self.conditions],
            "measured": [
                {"result": one.result, "at": list(one.at), "values": list(one.values)}
                | ({"sigma": list(one.sigma)} if one.sigma else {})
                for one in self.measured
            ],
            "loss": self.loss,
            "refits": self.refits,
            "seed": self.seed,
        } | ({"sensors": [_sensor_json(one) for one in self.sensors]} if self.sensors else {})


def _prior(data: Mapping[str, Any]) -> tuple[float, float] | None:
    if "prior" not in data:
        return None
    mean, deviation = map(float, data["prior"])
    return mean, deviation


def _measured(data: Mapping[str, Any]) -> Measured:
    return Measured(
        str(data["result"]),
        tuple(map(int, data["at"])),
        tuple(map(float, data["values"])),
        tuple(map(float, data.get("sigma", ()))),
    )


def _sensor_json(sensor: Sensor) -> dict[str, Any]:
    return {"result": sensor.result, "gain": list(sensor.gain), "offset": list(sensor.offset)}


def _sensor(data: Mapping[str, Any]) -> Sensor:
    (gain, offset) = ((float(low), float(high)) for low, high in (data["gain"], data["offset"]))
    return Sensor(str(data["result"]), gain, offset)


def _check(holds: bool, name: str, value: object, allowed: str) -> None:
    if not holds:
        raise WrongPlanError(
            Sentence("calibrate.{name} is {value}; allowed: {allowed}", name=name, value=str(value), allowed=allowed)
        )


def _check_sensors(plan: CalibratePlan) -> None:
    names = [one.result for one in plan.sensors]
    _check(len(set(names)) == len(names), "sensors", names, "each result once")
    for i, one in enumerate(plan.sensors):
        _check(one.result in plan.results, f"sensors.{i}", one.result, "a measured result")
        _check(
            0.0 < one.gain[0] <= one.gain[1] < math.inf, f"sensors.{i}.gain", one.gain, "positive, the lower end first"
        )
        low, high = one.offset
        _check(math.isfinite(low) and low <= high < math.inf, f"sensors.{i}.offset", one.offset, "the lower end first")


def _check_measured(plan: CalibratePlan) -> None:
    _check(bool(plan.conditions), "conditions", [], "at least one")
    for i, point in enumerate(plan.conditions):
        fits = len(point) == len(plan.paths_at) and all(map(math.isfinite, point))
        _check(fits, f"conditions.{i}", list(point), f"{len(plan.paths_at)} finite numbers")
    _check(len(set(plan.conditions)) == len(plan.conditions), "conditions", len(plan.conditions), "each once")
    _check(bool(plan.measured), "measured", [], "at least one result")
    _check(len(set(plan.results)) == len(plan.results), "measured", list(plan.results), "each result once")
    least = max(1, len(plan.fitted) + 1 - len(plan.priors))
    _check(least <= plan.count <= MOST_MEASURED, "measured", plan.count, f"{least} to {MOST_MEASURED:,} values")
    for one in plan.measured:
        lengths = {len(one.at), len(one.values), len(one.sigma) or len(one.at)}
        _check(len(lengths) == 1, one.result, sorted(lengths), "as many conditions, values and standard deviations")
        inside = all(0 <= place < len(plan.conditions) for place in one.at)
        _check(inside, one.result, "a condition that does not exist", "0 to the number of conditions less 1")
        _check(all(map(math.isfinite, one.values)), one.result, "a value that is not finite", "finite values")
        _check(all(0.0 < s < math.inf for s in one.sigma), f"{one.result}.sigma", "not positive", "positive numbers")
