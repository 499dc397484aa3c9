"""Strobes of a case and its orbit: they close, and they are what the run and the characteristics say."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks.workloads import W1
from sprag_study.engine.endings import Ending
from sprag_study.engine.run import Run, SettledRun, Span
from sprag_study.engine.vibration_drive.portrait import MAX_STROBES, portrait, settled_portrait
from sprag_study.engine.vibration_drive.regimes import settled_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.simulate import trajectory
from sprag_study.engine.vibration_drive.strobes import BEGIN


def drive(**changes: float) -> dict[str, Any]:
    """25 Hz, 2 mm, 0.2 N*m: a motion of order 2."""
    columns = {path: float(np.asarray(value).reshape(-1)[0]) for path, value in W1.columns(np.array([0])).items()}
    columns |= {"excitation.frequency": 25.0, "excitation.amplitude_x": 2e-3, "excitation.amplitude_y": 2e-3}
    return {**columns, "shaft.load": 0.2, **{path.replace("__", "."): value for path, value in changes.items()}}


def test_the_orbit_closes_and_the_strobes_come_to_it() -> None:
    found = settled_portrait(drive(), SettledRun())
    assert (found.regime, found.order, found.ending) == ("periodic", 2, Ending.OK)
    batch = settle(drive(), SettledRun(), cases=1)
    # Found with moved strobes: its turn is told from the start of a period all the same.
    assert batch.points[0, BEGIN] == 0.375
    column = {name: found.orbit.values[:, k] for k, name in enumerate(found.orbit.names)}
    assert found.orbit.times[-1] == pytest.approx(2 / 25.0, rel=1e-15)
    for k, name in enumerate(found.strobes.names):
        assert column[name][0] == pytest.approx(column[name][-1], abs=1e-6), name
        ends = column[name][: -1 : found.points]
        assert len(ends) == 2
        last = found.strobes.values[-2:, k]
        assert sorted(last) == pytest.approx(sorted(ends), abs=1e-5), name
    row = dict(zip([info.name for info in settled_infos(1)], batch.values[0].tolist(), strict=True))
    assert column["shaft.speed"].max() == pytest.approx(row["shaft.speed.max"], rel=1e-3)
    assert column["shaft.angle"][-1] - column["shaft.angle"][0] == pytest.approx(row["shaft.turn"], rel=1e-9)
    assert found.strobes.times.size >= row["regime.settled_after"]


def test_strobes_are_the_trajectory_once_a_period() -> None:
    run = Run(duration=Span(12.5))
    found = portrait(drive(), run)
    assert (found.regime, found.order, found.orbit.times.size) == ("", 0, 0)
    assert found.strobes.times == pytest.approx(np.arange(1, 13) / 25.0)
    same = trajectory(drive(), run, found.strobes.times)
    for k, name in enumerate(found.strobes.names):
        assert found.strobes.values[:, k] == pytest.approx(same.values[:, same.names.index(name)], abs=1e-9), name
    assert found.strobes.states == same.states


def test_of_a_long_run_the_last_strobes_are_told() -> None:
    found = portrait(drive(), Run(duration=Span(MAX_STROBES + 7.0)))
    assert found.strobes.times.size == MAX_STROBES
    assert found.strobes.times[0] == pytest.approx(8 / 25.0)
    assert found.strobes.times[-1] == pytest.approx((MAX_STROBES + 7) / 25.0)


def test_without_an_orbit_there_are_the_strobes_of_the_search() -> None:
    found = settled_portrait(drive(), SettledRun(at_most=100))
    assert (found.regime, found.order, found.orbit.times.size) == ("unsettled", 0, 0)
    assert found.strobes.times.size == 100
