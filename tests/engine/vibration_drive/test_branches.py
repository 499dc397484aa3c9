"""Branches of a drive's orbits: against settled cases, brute force, and each other."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.engine.continuation.follow import Range
from sprag_study.engine.continuation.problem import Contact, End, Kind
from sprag_study.engine.run import Run, SettledRun
from sprag_study.engine.vibration_drive.branches import DriveBranch, NoOrbitError, branch
from sprag_study.engine.vibration_drive.cases import case_matrix, with_lengths
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.regimes import settled_infos
from sprag_study.engine.vibration_drive.results import orbit_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.strobes import BEGIN, SHAFT_SPEED, SHAFT_WIDTH, SPEED
from tests.engine.vibration_drive.drive import drive

Floats = NDArray[np.float64]
NAMES = [info.name for info in orbit_infos(1)]
SETTLED = [[info.name for info in settled_infos(1)].index(name) for name in NAMES]


def machines(values: Floats, **changes: float) -> dict[str, Any]:
    """25 Hz, 2 mm, and values of the load."""
    return {**drive(excitation__frequency=25.0, **changes), "shaft.load": values}


@pytest.fixture(scope="module")
def first() -> DriveBranch:
    """The motion of order 1, past the load at which it loses its stability."""
    return branch(machines, 0.23, SettledRun(), Range(0.215, 0.24, first=0.1, most=0.2), (0.0, np.inf))


@pytest.fixture(scope="module")
def second() -> DriveBranch:
    """The motion of order 2."""
    return branch(machines, 0.2, SettledRun(), Range(0.195, 0.24, first=0.05, most=0.1), (0.0, np.inf))


def test_a_period_doubles_where_both_branches_say(first: DriveBranch, second: DriveBranch) -> None:
    (doubling,) = first.specials
    assert (first.order, doubling.kind, first.ends) == (1, Kind.DOUBLING, (End.RANGE, End.RANGE))
    assert doubling.multipliers[0] == pytest.approx(-1.0, abs=1e-8)
    assert doubling.parameter == pytest.approx(0.2229896, abs=1e-7)
    for k, point in enumerate(first.points):
        assert point.stable == (k > doubling.index)
        assert (point.parameter > doubling.parameter) == (k > doubling.index)
    grazing, halved = second.specials
    assert (second.order, grazing.kind, halved.kind) == (2, Kind.GRAZING, Kind.DOUBLING)
    assert second.ends == (End.RANGE, End.HALVED)
    assert halved.parameter == pytest.approx(doubling.parameter, abs=1e-7)
    assert grazing.contacts == (Contact("pendulums.0", "engaged", 1, 2),)
    # The speed is continuous where a second engagement appears, its slope is not.
    speeds = second.values[:, NAMES.index("shaft.speed.mean")]
    assert speeds[grazing.index + 1] == pytest.approx(speeds[grazing.index], rel=1e-7)


def test_a_period_is_halved_where_the_equations_are_singular() -> None:
    """The steps of this branch are symmetrical to the doubling, so that the first estimate of its place meets it."""
    made = branch(machines, 0.05, SettledRun(), Range(0.03, 0.4), (0.0, np.inf))
    assert (made.order, made.ends) == (4, (End.RANGE, End.HALVED))
    assert made.specials[-1].parameter == pytest.approx(0.08947439, abs=1e-7)


def test_stable_points_are_the_settled_cases(first: DriveBranch, second: DriveBranch) -> None:
    for made in (first, second):
        # Near a doubling cases take longer to settle than they may; near a grazing engagements last by its root.
        specials = np.array([special.parameter for special in made.specials])
        rows = [
            row
            for row, point in enumerate(made.points)
            if point.stable and np.all(abs(point.parameter - specials) > 5e-3)
        ]
        assert len(rows) > 1
        loads = np.array([made.points[row].parameter for row in rows])
        found = settle(machines(loads), SettledRun(), cases=len(rows))
        np.testing.assert_allclose(made.values[rows], found.values[:, SETTLED], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("away", "stays"), [(1e-3, True), (-1e-3, False)])
def test_brute_force_agrees_to_either_side(first: DriveBranch, away: float, stays: bool) -> None:
    load = first.specials[0].parameter + away
    loads = np.array([point.parameter for point in first.points])
    state = np.array([np.interp(load, loads, column) for column in np.array([p.state for p in first.points]).T])
    columns, run = machines(np.array([load])), Run()
    matrix = with_lengths(case_matrix(columns, run, 1), state[None, BEGIN], np.array([3000.0]), windowed=False)
    strobes = integrate(kernel_of(columns, run.tolerance), matrix, run, starts=state[None], strobes=2).strobes[0]
    scale = abs(state[SHAFT_WIDTH + SPEED])
    apart = abs(strobes[0] - strobes[1])[[SHAFT_SPEED, SHAFT_WIDTH + SPEED]].max() / scale
    assert apart < 1e-6 if stays else apart > 1e-3


def test_points_do_not_depend_on_the_section() -> None:
    """An event close to the strobe moves it; the results belong to whole turns and do not change."""
    made = branch(machines, 0.62, SettledRun(), Range(0.6, 0.95, first=0.2, most=0.2), (0.0, np.inf))
    assert not made.specials
    assert len({point.state[BEGIN] for point in made.points}) == 2
    loads = np.array([point.parameter for point in made.points])
    found = settle(machines(loads), SettledRun(), cases=len(loads))
    np.testing.assert_allclose(made.values, found.values[:, SETTLED], rtol=1e-9, atol=1e-9)


def test_motion_without_an_orbit_is_refused() -> None:
    still = partial(machines, excitation__amplitude_x=0.0)
    with pytest.raises(NoOrbitError, match="never turn the shaft"):
        branch(still, 0.2, SettledRun(), Range(0.1, 0.3), (0.0, np.inf))
