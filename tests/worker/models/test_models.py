"""The border between studies and the engine."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sprag_study.engine.endings import Ending
from sprag_study.worker import models
from sprag_study.worker.study import Axis, Study
from tests.worker import fakes


def test_every_ending_has_a_sentence() -> None:
    assert set(models.ENDING_SENTENCES) == {ending.value for ending in (*Ending, *models.WorkerEnding)}
    assert all(sentence.endswith(".") for sentence in models.ENDING_SENTENCES.values())
    for model in models.model_names():
        assert all(sentence.endswith(".") for sentence in models.flags_of(model).values())


def test_unknown_models_are_named() -> None:
    assert models.model_names() == ("vibration-drive", "machine-shaft")
    for ask in (models.parameter_catalogue, models.variants, lambda model: models.result_infos(model, "")):
        with pytest.raises(ValueError, match="'steam-engine'; known models: vibration-drive, machine-shaft"):
            ask("steam-engine")


def test_two_models_cannot_have_one_name() -> None:
    with pytest.raises(ValueError, match="there already is a model 'machine-shaft'"):
        models.register(models.model_of("machine-shaft"))


def test_the_catalogues_are_complete() -> None:
    paths = [parameter.path for parameter in models.parameter_catalogue("vibration-drive")]
    assert len(set(paths)) == len(paths)
    assert {"shaft.load", "pendulums.N.mass", "clutch.coefficients.K", "clutch.windup_limit"} <= set(paths)
    for variant in models.variants("vibration-drive"):
        infos = models.result_infos("vibration-drive", variant)
        assert len({info.column for info in infos}) == len(infos)


def test_the_shape_of_a_machine_comes_from_its_paths() -> None:
    study = fakes.study(3)
    assert models.shape_of(study) == models.KernelShape("vibration-drive", (1, 4, 1e-9))
    own_clutch = {"pendulums.2.clutch.coefficients.4": 1.0}
    assert models.variant_of(replace(study, base=study.base | own_clutch)) == "3"
    assert models.coefficients(replace(study, base=study.base | own_clutch)) == 5
    on_axis = Axis(("pendulums.1.mass", "clutch.coefficients.5"), (0.5,))
    assert models.variant_of(replace(study, axes=(on_axis,))) == "2"
    assert models.coefficients(replace(study, axes=(on_axis,))) == 6
    assert len(models.study_results(study)) == fakes.RESULTS


def test_a_process_gets_its_own_cases_only() -> None:
    study = fakes.study(100_000)
    task = models.chunk_task(study, 99_990, 10)
    assert len(pickle.dumps(task)) < 5_000
    np.testing.assert_array_equal(task.columns["shaft.load"], np.arange(99_990, 100_000) * 1e-3)
    assert task.columns["shaft.inertia"] == study.base["shaft.inertia"]


def test_results_travel_small() -> None:
    result = models.run_chunk(fakes.study(20), 0, 20)
    assert result.count == 20
    assert result.values.flags.c_contiguous
    assert not np.signbit(result.values[result.values == 0.0]).any()
    assert len(pickle.dumps(result)) < result.values.nbytes + 1_000


def test_work_beyond_the_measured_data_is_flagged() -> None:
    study = fakes.study(2)
    run = {"duration": [20.0, "periods"], "window": None, "tolerance": 1e-9, "reset": "contact"}
    within = models.run_chunk(replace(study, run=run), 0, 2)
    beyond = models.run_chunk(replace(study, run=run, base=study.base | {"clutch.windup_limit": 1e-4}), 0, 2)
    assert within.endings == beyond.endings == ["ok", "ok"]
    assert not any(models.WINDUP_OUT_OF_DATA in flags for flags in within.flags)
    assert all(models.WINDUP_OUT_OF_DATA in flags.split(",") for flags in beyond.flags)


def test_a_motion_that_has_not_settled_is_flagged() -> None:
    study = fakes.study(2)

    def flags(periods: float) -> list[str]:
        run = {"duration": [periods, "periods"], "window": None, "tolerance": 1e-9, "reset": "contact"}
        return models.run_chunk(replace(study, run=run), 0, 2).flags

    assert flags(3.0) == [models.NOT_SETTLED] * 2
    assert flags(600.0) == ["", ""]


def test_runs_are_given_in_periods_or_seconds() -> None:
    study = fakes.study(2)
    assert models.duration_seconds(study, 0) == pytest.approx(3.0 / 25.0)
    seconds = replace(study, run=study.run | {"duration": [2.0, "s"], "window": [[1.0, "s"], [2.0, "s"]]})
    assert models.duration_seconds(seconds, 0) == 2.0
    run = models.run_of(seconds.run)
    assert run.window_in_periods(25.0) == (25.0, 50.0)
    fast = Axis(("excitation.frequency",), (10.0, 50.0))
    assert models.duration_seconds(replace(study, axes=(fast,)), 1) == pytest.approx(3.0 / 50.0)


def test_the_estimate_grows_with_the_run() -> None:
    def estimate(study: Study) -> float:
        return models.estimate_seconds_per_case(study)

    short = fakes.study(2)
    longer = replace(short, run=short.run | {"duration": [30.0, "periods"]})
    slower = replace(
        short, axes=(Axis(("excitation.frequency",), (5.0, 15.0)),), run=short.run | {"duration": [3.0, "s"]}
    )
    assert 0.0 < estimate(short) < estimate(longer)
    assert estimate(slower) == pytest.approx(estimate(longer), rel=0.2)


def test_the_estimate_knows_that_slow_excitation_takes_more_steps_a_period() -> None:
    # Counted with the shipped drive: 338 steps a period at 0.1 Hz, 63 at 1 Hz.
    times = [
        models.estimate_seconds_per_case(replace(fakes.study(2), axes=(Axis(("excitation.frequency",), (frequency,)),)))
        for frequency in (0.1, 1.0)
    ]
    assert times[0] / times[1] == pytest.approx(338 / 63, rel=0.2)


def test_a_trajectory_is_that_of_the_case() -> None:
    study = fakes.study(3)
    end = models.duration_seconds(study, 2)
    trajectory = models.run_trajectory(study, 2, 0.0, end, 11)
    np.testing.assert_allclose(trajectory.times, np.linspace(0.0, end, 11))
    assert trajectory.values.shape == (11, len(trajectory.names))


def test_a_kernel_counts_as_compiled_once_it_was_loaded(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(models, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr("sprag_study.engine.vibration_drive.simulate.warm_up", lambda *_: None)
    study = fakes.study(3)
    shape = models.shape_of(study)
    assert not models.is_compiled(shape)
    assert models.estimate_compile_seconds(study) > 1.0
    models.load(shape)
    assert models.is_compiled(shape)
    assert models.estimate_compile_seconds(study) == 0.0
    assert not models.is_compiled(replace(shape, key=(*shape.key[:-1], 1e-8)))
    assert not models.is_compiled(replace(shape, key=(1, 3, 1e-9)))


def test_torques_that_depend_on_speeds_need_another_kernel() -> None:
    study = fakes.study(3)
    given = replace(study, base=study.base | {"shaft.bearing_damping": 2e-3, "shaft.quadratic_load": 1e-4})
    shape = models.shape_of(given)
    assert shape == models.KernelShape("vibration-drive", (1, 4, 1e-9, "drag"))
    assert models.variant_of(given) == models.variant_of(study)
    on_axis = replace(study, axes=(*study.axes, Axis(("shaft.linear_load",), (0.0, 1e-3, 2e-3))))
    assert models.shape_of(on_axis) == shape
    infos = [info.name for info in models.study_results(given)]
    column = infos.index("power.quadratic.mean")
    assert not models.run_chunk(study, 0, 3).values[:, column].any()
    found = models.run_chunk(given, 0, 3)
    assert found.endings == ["ok"] * 3
    assert (found.values[:, column] > 0.0).all()
    known = models.model_of("vibration-drive").known_answers
    assert known(shape) != known(models.shape_of(study))
    curved = models.shape_of(replace(given, base=given.base | {"shaft.stribeck_load": 0.1}))
    assert curved.key == (1, 4, 1e-9, "curve")
    assert len({known(curved), known(shape), known(models.shape_of(study))}) == 3


def test_a_drawn_case_with_a_cyclic_load_is_no_machine_where_motion_is_to_settle() -> None:
    model, study = models.model_of("vibration-drive"), fakes.study(3)
    columns = {"shaft.cyclic_load": np.array([0.0, 0.1, 1.0]), "clutch.coefficients.0": 1.0}
    settled = replace(study, run={"until": "settled", "at_most": 1000})
    assert model.invalid(settled, columns, 3).tolist() == [False, True, True]
    assert not model.invalid(replace(study, run={"duration": [40.0, "periods"]}), columns, 3).any()
