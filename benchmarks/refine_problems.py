"""Curves and maps for `benchmarks.refine`: presets over one or two of their parameters, settled and not."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sprag_study.service.presets import preset_text
from sprag_study.service.spec.document import format_of, load_spec, parse_spec
from sprag_study.worker import models
from sprag_study.worker.planning.refine_plan import AdaptiveAxis, RefinePlan, half_widths_of
from sprag_study.worker.planning.rounds import Rows
from sprag_study.worker.study import Axis, Study

Floats = NDArray[np.float64]

AMPLITUDE = ("excitation.amplitude_x", "excitation.amplitude_y")
FREQUENCY, LOAD = ("excitation.frequency",), ("shaft.load",)
DRIVE_RESULTS = ("shaft.speed.mean", "torque.max", "efficiency", "shaft.irregularity")
SHAFT_RESULTS = ("irregularity", "drive_torque.max", "acceleration.max", "required_inertia")
#: Window of runs of a given time.
TIMED = {"duration": [60.0, "periods"], "window": [[40.0, "periods"], [60.0, "periods"]]}


@dataclass(frozen=True)
class Problem:
    """A curve or a map: a study of one case, and what varies.

    Attributes
    ----------
    name : str
    study : Study
        Without axes.
    axes : tuple of AdaptiveAxis
        One or two, SI.
    results : tuple of str
    """

    name: str
    study: Study
    axes: tuple[AdaptiveAxis, ...]
    results: tuple[str, ...] = field(default=DRIVE_RESULTS)

    def plan(self, error: float, start: int, finest: int) -> RefinePlan:
        """The plan of its refinement."""
        names = [info.name for info in models.study_results(self.study)]
        settled = "regime" in names
        widths = half_widths_of(self.results, names)
        return RefinePlan(self.results, error, start, finest, self.axes, regime=settled, half_widths=widths)

    def rows(self, points: Floats) -> Rows:
        """Rows of points, shape (m, axes), computed by the engine in this process."""
        columns = tuple(Axis(axis.paths, points[:, k]) for k, axis in enumerate(self.axes))
        study = replace(self.study, axes=columns, combine="zip")
        result = models.run_task(models.chunk_task(study, 0, len(points)))
        names = [info.name for info in models.study_results(study)]
        ok = np.array([ending == "ok" for ending in result.endings])
        return Rows(points, ok, {name: result.values[:, k] for k, name in enumerate(names)})


def _preset(name: str, values: Mapping[str | tuple[str, ...], float], run: dict[str, Any] | None = None) -> Study:
    file, text = preset_text(name)
    study = parse_spec(load_spec(text, format_of(file))).study
    base = dict(study.base)
    for paths, value in values.items():
        base |= dict.fromkeys((paths,) if isinstance(paths, str) else paths, value)
    own = {key: study.run[key] for key in ("tolerance", "reset") if key in study.run}
    return replace(study, base=base, axes=(), run=study.run if run is None else own | run)


def over_speed(preset: str, amplitude: float, load: float, run: dict[str, Any] | None = None) -> Problem:
    """A drive over 100 to 220 rad/s of excitation; amplitude in mm, load in N*m."""
    study = _preset(preset, {AMPLITUDE: amplitude * 1e-3, LOAD: load}, run)
    axis = AdaptiveAxis(FREQUENCY, 100.0 / (2.0 * math.pi), 220.0 / (2.0 * math.pi))
    return Problem(f"{preset} over frequency at {amplitude} mm, {load} N*m", study, (axis,))


def over_load(preset: str, nu: float, amplitude: float, run: dict[str, Any] | None = None) -> Problem:
    """A drive over loads up to 1.2 N*m; angular frequency in rad/s, amplitude in mm."""
    study = _preset(preset, {FREQUENCY: nu / (2.0 * math.pi), AMPLITUDE: amplitude * 1e-3}, run)
    return Problem(f"{preset} over load at {nu} rad/s, {amplitude} mm", study, (AdaptiveAxis(LOAD, 0.0, 1.2),))


def _shaft(preset: str, path: str, low: float, high: float, **values: float) -> Problem:
    study = _preset(preset, {key.replace("__", "."): value for key, value in values.items()})
    return Problem(f"{preset} over {path}", study, (AdaptiveAxis((path,), low, high),), SHAFT_RESULTS)


def one_pendulum() -> list[Problem]:
    """Sixteen curves of the drive with one pendulum, settled."""
    speeds = ((1, 0.1), (1, 0.23), (1.5, 0.1), (1.5, 0.3), (2, 0.1), (2, 0.25), (3, 0.1), (3, 0.3))
    loads = ((110, 2), (130, 2), (140, 1), (157, 1), (157, 2), (175, 1.5), (190, 2), (210, 3))
    preset = "one_pendulum"
    return [
        *(over_speed(preset, amplitude, load) for amplitude, load in speeds),
        *(over_load(preset, nu, amplitude) for nu, amplitude in loads),
    ]


def two_pendulums() -> list[Problem]:
    """Eight curves of the drive with two pendulums, settled."""
    preset = "two_pendulums"
    speeds = ((1, 0.1), (1.5, 0.3), (2, 0.2), (3, 0.5))
    loads = ((125, 2), (150, 1.5), (175, 2), (200, 3))
    return [
        *(over_speed(preset, amplitude, load) for amplitude, load in speeds),
        *(over_load(preset, nu, amplitude) for nu, amplitude in loads),
    ]


def timed() -> list[Problem]:
    """Four curves of runs of a given time."""
    return [
        over_speed("one_pendulum", 2, 0.1, TIMED),
        over_speed("one_pendulum", 3, 0.3, TIMED),
        over_load("one_pendulum", 157, 2, TIMED),
        over_load("two_pendulums", 175, 2, TIMED),
    ]


def machine_shafts() -> list[Problem]:
    """Six curves of machine shafts; some cases have no steady motion."""
    return [
        _shaft("press", "drive.inertia", 2.0, 80.0),
        _shaft("press", "mean_speed", 3.0, 25.0),
        _shaft("compressor", "operation.gas.discharge_pressure", 1.5e5, 12e5),
        _shaft("compressor", "mean_speed", 20.0, 160.0),
        _shaft("slotter", "operation.steps.0.value", 0.0, 40e3),
        _shaft("shaper", "operation.scale", 0.1, 2.0),
    ]


def maps() -> list[Problem]:
    """Maps of drives and machine shafts."""
    frequency = AdaptiveAxis(FREQUENCY, 100.0 / (2.0 * math.pi), 220.0 / (2.0 * math.pi))
    load, amplitude = AdaptiveAxis(LOAD, 0.02, 0.5), AdaptiveAxis(AMPLITUDE, 0.001, 0.003)
    pressure = AdaptiveAxis(("operation.gas.discharge_pressure",), 1.5e5, 12e5)
    inertia, speed = AdaptiveAxis(("drive.inertia",), 5.0, 80.0), AdaptiveAxis(("mean_speed",), 3.0, 25.0)
    one, means = _preset("one_pendulum", {AMPLITUDE: 0.002}), ("shaft.speed.mean", "efficiency")
    return [
        Problem("one_pendulum over frequency and load at 2 mm", one, (frequency, load), means),
        Problem("one_pendulum over amplitude and load at 25 Hz", one, (amplitude, load), means),
        Problem("one_pendulum over frequency and load at 2 mm, four results", one, (frequency, load)),
        Problem("compressor over pressure and inertia", _preset("compressor", {}),
                (pressure, replace(inertia, low=0.2, high=1.6)), SHAFT_RESULTS),
        Problem("press over inertia and speed", _preset("press", {}), (inertia, speed), SHAFT_RESULTS),
    ]  # fmt: skip


def families() -> dict[str, Sequence[Problem]]:
    """All curves by the name of their family."""
    return {
        "one pendulum": one_pendulum(),
        "two pendulums": two_pendulums(),
        "runs of a given time": timed(),
        "machine shafts": machine_shafts(),
    }
