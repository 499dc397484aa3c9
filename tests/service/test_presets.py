"""The studies that come with the program run, and show what they say they show."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.service.presets import ABOUT, preset_names, preset_text
from sprag_study.service.spec.document import format_of, load_spec, parse_spec
from sprag_study.worker import models
from sprag_study.worker.axis import Axis
from sprag_study.worker.limits import MAX_AXES
from sprag_study.worker.study import Study

MACHINES = [name for name in preset_names() if "machine-shaft" in preset_text(name)[1]]


def run(name: str) -> tuple[Study, list[str], dict[str, NDArray[np.float64]]]:
    """A machine's study, its endings and its results on the grid of its axes."""
    file, text = preset_text(name)
    parsed = parse_spec(load_spec(text, format_of(file)))
    study = parsed.study
    assert parsed.warnings == ()
    result = models.run_chunk(study, 0, study.cases)
    names = [info.name for info in models.study_results(study)]
    return study, result.endings, {n: result.values[:, k].reshape(study.shape) for k, n in enumerate(names)}


def test_every_study_is_described() -> None:
    assert list(preset_names()) == list(ABOUT)
    assert {"press", "shaper", "slotter", "compressor", "conveyor", "cam_machine", "one_pendulum"} <= set(ABOUT)
    for name, about in ABOUT.items():
        assert about.shows
        assert about.values
        file, text = preset_text(name)
        assert about.cases == parse_spec(load_spec(text, format_of(file))).study.cases, name


@pytest.mark.parametrize("name", MACHINES)
def test_machines_run(name: str) -> None:
    study, endings, results = run(name)
    assert endings.count("ok") >= 0.75 * study.cases
    if name != "slotter":
        asked = study.columns(range(study.cases)).get("mean_speed", np.full(study.cases, study.base.get("mean_speed")))
        ok = np.array(endings) == "ok"
        assert results["omega.mean"].ravel()[ok] == pytest.approx(asked[ok], rel=1e-10)
    assert np.nanmax(results["balance.work"]) < 1e-9


def new_kinds(name: str, varied: set[str]) -> tuple[Any, list[str]]:
    """The spec of a machine without axes, and its numbers of other kinds than ``varied``, which are added there.

    Of equal parts, steps and the like it has the numbers of the last one.
    """
    file, text = preset_text(name)
    spec: Any = load_spec(text, format_of(file))
    spec.pop("goal", None)
    spec["axes"] = []
    kinds = {re.sub(r"\.\d+(?=\.|$)", ".N", path): path for path in models.parameters_of(parse_spec(spec).study)}
    new = [path for kind, path in kinds.items() if kind not in varied]
    varied |= set(kinds)
    return spec, new


def test_any_number_varies_alone_and_in_batches() -> None:
    """Each kind of number is an axis of the first machine that has it."""
    varied: set[str] = set()
    for name in MACHINES:
        spec, paths = new_kinds(name, varied)
        base = parse_spec(spec).study
        axes = [Axis((path,), two_values(base, path)) for path in paths]
        for first in range(0, len(paths), MAX_AXES):
            some = paths[first : first + MAX_AXES]
            given = [{"path": path, "values": [base.base.get(path, 0.5)]} for path in some]
            assert parse_spec(spec | {"axes": given}).study.axis_paths == tuple(some)
        for axis in axes:
            study = replace(base, axes=(axis,))
            batch = models.run_chunk(study, 0, study.cases)
            alone = models.run_chunk(study, study.cases - 1, 1)
            assert alone.endings == batch.endings[-1:], (name, axis.paths)
            np.testing.assert_array_equal(alone.values[0], batch.values[-1], err_msg=f"{name}: {axis.paths}")
    assert len(varied) > 90


def two_values(base: Study, path: str) -> tuple[float, ...]:
    """Those of two values beside that of ``base`` that the number may have."""
    value = base.base.get(path, 0.5)
    accepts = models.parameters_of(base)[path].accepts
    return tuple(dict.fromkeys(v for v in (0.97 * value, 1.02 * value + 1e-3) if accepts(v)))


def decreasing(values: NDArray[np.float64], axis: int) -> bool:
    steps = np.diff(values, axis=axis)
    return bool(np.all(steps[~np.isnan(steps)] < 0.0))


def increasing(values: NDArray[np.float64], axis: int) -> bool:
    return decreasing(-values, axis)


def test_first_question() -> None:
    _, _, got = run("question_drive_inertia")
    assert decreasing(got["irregularity"], 1)
    assert decreasing(got["irregularity"], 0)
    # The fluctuation is the operation's alone: irregularity times inertia times speed squared stays nearly the same.
    constant = got["irregularity"] * got["inertia.mean"] * got["omega.mean"] ** 2
    assert constant == pytest.approx(got["energy.fluctuation"], rel=0.1)


def test_second_question() -> None:
    _, _, got = run("question_masses")
    assert increasing(got["irregularity"], 1)
    assert increasing(got["s1.amplitude"], 0)
    assert got["irregularity"][3, -1] < got["irregularity"][0, -1]


def test_third_question() -> None:
    study, _, got = run("question_operation")
    assert decreasing(got["irregularity"], 1)
    force = np.array(study.axes[0].values)
    assert got["work.resistance"] == pytest.approx(got["work.resistance"][:1] * (force / force[0])[:, None], rel=1e-10)


def test_what_the_machines_show() -> None:
    _, endings, press = run("press")
    assert decreasing(press["irregularity"], 1)
    assert set(endings) == {"ok", "inertia_insufficient"}
    _, _, shaper = run("shaper")
    assert shaper["required_inertia"][2] == pytest.approx(2.0 * shaper["required_inertia"][1], rel=0.01)
    _, endings, slotter = run("slotter")
    assert set(endings) == {"ok", "motor_stalled"}
    assert decreasing(slotter["omega.mean"], 0)
    assert decreasing(slotter["drive_torque.max"], 1)
    _, endings, six_bar = run("six_bar_press")
    assert set(endings) == {"ok"}
    assert increasing(six_bar["irregularity"], 0)
    assert decreasing(six_bar["irregularity"], 1)
    study, _, compressor = run("compressor")
    assert increasing(compressor["required_inertia"], 0)
    pressure: Any = np.array(study.axes[0].values)[:, None]
    assert decreasing((compressor["required_inertia"] / pressure)[2:], 0)
    _, _, conveyor = run("conveyor")
    assert (conveyor["s1.amplitude"][2:, 4:] > conveyor["s4.amplitude"][2:, 4:]).all()
    _, _, cam = run("cam_machine")
    spread = np.ptp(cam["irregularity"], axis=1) / cam["irregularity"].mean(axis=1)
    assert (spread < 0.1).all()
    assert decreasing(cam["irregularity"], 0)
