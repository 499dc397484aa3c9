"""Torsional vibration of trains with couplings, against closed forms, scipy, and the full equations of motion."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

from sprag_study.engine.machine_shaft.load_results import infos_of
from sprag_study.engine.machine_shaft.panels import Panels
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice
from sprag_study.engine.machine_shaft.torsion import CaseChain, Signals, Vibration, answered, natural_frequencies
from tests.engine.machine_shaft.machines import NAMES, PRESS, PRESS_NUMBERS, one

Floats = NDArray[np.float64]
MIXER = MachineSpec(operation=OperationChoice("torque", "formula", formula="40 + 25*cos(3*phi) + 9*sin(7*phi)"))


def frequencies(inertias: list[float] | Floats, stiffness: list[float] | Floats) -> Floats:
    out = np.empty(len(stiffness))
    natural_frequencies(np.asarray(inertias, dtype=float), np.asarray(stiffness, dtype=float), out)
    return out


def matrices(train: CaseChain) -> tuple[Floats, Any]:
    """Inertias and complex stiffness of the angles of the bodies."""
    count = len(train.inertias)
    joined: Any = np.zeros((count, count), dtype=complex)
    for k, (stiff, loss) in enumerate(zip(train.stiffness, train.damping, strict=True)):
        joined[k : k + 2, k : k + 2] += stiff * (1.0 + 1j * loss / math.tau) * np.array([[1, -1], [-1, 1]])
    return np.diag(train.inertias), joined


def test_natural_frequencies_are_those_of_holzer_s_tables() -> None:
    # W. T. Thomson, Theory of Vibration with Applications, Holzer's method: three discs.
    assert frequencies([5, 11, 22], [1e5, 2e5]) == pytest.approx([123.666, 202.658], abs=5e-4)
    first, second, stiff = 0.7, 2.3, 5e3
    two = math.sqrt(stiff * (first + second) / (first * second))
    assert frequencies([first, second], [stiff])[0] == pytest.approx(two, rel=1e-14)
    rng = np.random.default_rng(3)
    for count in range(2, 17):
        inertias, stiffness = 10.0 ** rng.uniform(-3, 2, count), 10.0 ** rng.uniform(1, 6, count - 1)
        masses, joined = matrices(CaseChain(inertias, stiffness, np.zeros(count - 1)))
        squares = eigh(joined.real, masses, eigvals_only=True)[1:]
        assert np.square(frequencies(inertias, stiffness)) == pytest.approx(squares, rel=1e-9, abs=1e-10 * squares[-1])


def answer_to(train: CaseChain, pace: float, drive: Floats, load: Floats, count: int = 16) -> Vibration:
    """The answer to torques on the first and on the last body, rows of order, cos and sin, with that many panels."""
    panels = Panels.over(2.0 * math.pi, [], count)
    unit = panels.angles[0]

    def course(rows: Floats) -> Floats:
        return np.asarray(sum(a * np.cos(n * unit) + b * np.sin(n * unit) for n, a, b in rows))

    acceleration = (course(drive) + course(load)) / train.inertias.sum()
    weights = np.repeat(panels.half[0][:, None] / math.tau, unit.shape[1], axis=1)
    return answered(train, Signals(unit, weights, course(drive), acceleration), pace, 1)


def random_train(rng: np.random.Generator, couplings: int) -> CaseChain:
    return CaseChain(
        10.0 ** rng.uniform(-1, 1, couplings + 1), 10.0 ** rng.uniform(2, 4, couplings),
        rng.uniform(0.1, 1.5, couplings),
    )  # fmt: skip


def test_harmonics_are_those_of_the_equations_of_the_angles_and_their_power_is_dissipated() -> None:
    rng = np.random.default_rng(8)
    for couplings in (1, 2, 3, 5):
        train, pace = random_train(rng, couplings), rng.uniform(2.0, 20.0)
        drive, load = (np.column_stack([[1, 3, 8], rng.normal(size=(3, 2))]) for _ in range(2))
        answer = answer_to(train, pace, drive, load)
        masses, joined = matrices(train)
        for (n, a, b), (_, c, d) in zip(drive, load, strict=True):
            forces = np.zeros(couplings + 1, dtype=complex)
            forces[0], forces[-1] = a - 1j * b, c - 1j * d
            angles = np.linalg.solve(joined - (n * pace) ** 2 * masses, forces)
            twist = -np.diff(angles)
            torques = train.stiffness * (1.0 + 1j * train.damping / math.tau) * twist
            own = answer.elastic[:, 0, int(n) - 1] - 1j * answer.elastic[:, 1, int(n) - 1]
            assert own == pytest.approx(torques, rel=1e-9, abs=1e-10)
            # Mean power of the torques on both ends: what the damping of all couplings takes.
            inner = own / (train.stiffness * (1.0 + 1j * train.damping / math.tau))
            lost = 0.5 * n * pace * (train.stiffness * train.damping / math.tau * np.abs(inner) ** 2).sum()
            speeds = 1j * n * pace * angles
            assert 0.5 * (forces * speeds.conj()).real.sum() == pytest.approx(lost, rel=1e-9)


def test_a_single_harmonic_above_the_first_ones_is_seen() -> None:
    train, pace = CaseChain(np.array([1.0, 2.0]), np.array([3e5]), np.array([0.1])), 5.0
    order = 130
    answer = answer_to(train, pace, np.array([[0, 6.0, 0.0]]), np.array([[0, -6.0, 0.0], [order, 9.0, 0.0]]), 160)
    masses, joined = matrices(train)
    angles = np.linalg.solve(joined - (order * pace) ** 2 * masses, np.array([0.0, 9.0]))
    amplitude = abs(joined[0, 0] * (angles[0] - angles[1]))
    assert answer.ends[0] == pytest.approx([6.0 + amplitude, 6.0 - amplitude], rel=1e-8)


def test_the_peak_is_that_of_a_long_integration_from_rest() -> None:
    # Of one harmonic, a relative damping is a viscous one: c = psi k/(2 pi w).
    train, pace, order = CaseChain(np.array([0.4, 0.2, 1.5]), np.array([900.0, 1400.0]), np.array([1.2, 0.9])), 11.0, 3
    answer = answer_to(train, pace, np.array([[0, 6.0, 0.0]]), np.array([[0, -6.0, 0.0], [order, 5.0, 2.0]]))
    joined = matrices(train)[1]
    viscous = joined.imag / (order * pace)

    def slopes(time: float, state: Floats) -> Floats:
        load = 5.0 * math.cos(order * pace * time) + 2.0 * math.sin(order * pace * time) - 6.0
        torques = np.array([6.0, 0.0, load]) - joined.real @ state[:3] - viscous @ state[3:]
        return np.concatenate([state[3:], torques / train.inertias])

    cycles = np.linspace(60.0, 61.0, 4001) * math.tau / pace
    run = solve_ivp(slopes, (0.0, cycles[-1]), np.zeros(6), "DOP853", cycles, rtol=1e-12, atol=1e-13)
    twist, rate = -np.diff(run.y[:3], axis=0), -np.diff(run.y[3:], axis=0)
    torque = train.stiffness[:, None] * twist - np.diag(viscous, 1)[:, None] * rate
    assert answer.ends[:, 0] == pytest.approx(torque.max(axis=1), rel=1e-6)
    phase = order * pace * cycles
    series = answer.elastic[:, :1, order - 1] * np.cos(phase) + answer.elastic[:, 1:, order - 1] * np.sin(phase)
    assert np.abs(answer.mean + series - torque).max() < 1e-8


def coupled(*stages: Any, **numbers: float) -> tuple[MachineSpec, dict[str, float]]:
    """A mixer, whose torque is not even, behind a train."""
    spec = replace(MIXER, drive=Drive(stages=stages))
    return spec, {"mean_speed": 30.0, "drive.inertia": 20.0, **numbers}


def test_at_resonance_the_damping_alone_limits_the_torque() -> None:
    stiff, psi = 9e3, 0.3
    spec, numbers = coupled("coupling", **{
        "drive.stages.0.stiffness": stiff, "drive.stages.0.relative_damping": psi, "drive.stages.0.inertia": 1.0,
    })  # fmt: skip
    spec = replace(spec, operation=OperationChoice("torque", "formula", formula="40 + 25*cos(3*phi)"))
    natural = math.sqrt(stiff * (1.0 + 1.0 / 20.0))
    got = one(spec, numbers | {"mean_speed": natural / 3.0})
    assert got["torsion.natural_frequency"] == pytest.approx(natural, rel=1e-13)
    # The part 1/21 of the alternating torque passes a rigid coupling, the first body being 1 of 21 kg*m^2.
    rigid, loss = 25.0 / 21.0, psi / math.tau
    amplitude = rigid * math.sqrt(1.0 + loss * loss) / loss
    assert got["torsion.torque.amplitude"] == pytest.approx(amplitude, rel=2e-4)
    assert got["torsion.dynamic_factor"] == pytest.approx((40.0 + amplitude) / (40.0 + rigid), rel=2e-4)
    assert (got["torsion.order"], got["torsion.coupling"], got["torsion.reversals"]) == (3, 1, 0)
    assert got["torsion.margin"] < 1e-4
    away = one(spec, numbers | {"mean_speed": natural / 3.3})
    assert away["torsion.margin"] == pytest.approx(1.0 - 3.0 / 3.3, rel=1e-3)


def test_a_stiff_train_is_rigid_and_one_behind_a_gear_is_its_reduced_one() -> None:
    numbers = {
        "drive.stages.0.stiffness": 1e10, "drive.stages.0.inertia": 2.0, "drive.stages.0.output_inertia": 1.0,
    }  # fmt: skip
    stiff = one(*coupled("coupling", **numbers))
    assert stiff["torsion.dynamic_factor"] == pytest.approx(1.0, abs=1e-5)
    soft = numbers | {"drive.stages.0.stiffness": 5e4, "drive.stages.0.relative_damping": 0.5}
    reduced = one(*coupled("coupling", **soft))
    ratio, share = 4.0, 0.9
    fast = {
        "drive.stages.0.stiffness": 5e4 / ratio**2, "drive.stages.0.relative_damping": 0.5,
        "drive.stages.0.inertia": 2.0 / ratio**2, "drive.stages.0.output_inertia": 0.25 / ratio**2,
        "drive.stages.1.ratio": ratio, "drive.stages.1.efficiency": share, "drive.stages.1.output_inertia": 0.75,
    }  # fmt: skip
    geared = one(*coupled("coupling", "gear", **fast))
    for name in ("natural_frequency", "order", "margin", "dynamic_factor", "reversals"):
        assert geared[f"torsion.{name}"] == pytest.approx(reduced[f"torsion.{name}"], rel=1e-9), name
    own = reduced["torsion.torque.amplitude"] / (ratio * share)
    spec, values = coupled("coupling", "gear", **fast)
    row = simulate(spec, values, cases=1, with_loads=True).values[0]
    loads = dict(zip([info.name for info in infos_of(spec)], row[len(NAMES) :].tolist(), strict=True))
    assert loads["couplings.0.torque.amplitude"] == geared["torsion.torque.amplitude"]
    assert loads["couplings.0.dynamic_factor"] == geared["torsion.dynamic_factor"]
    # The mean torque of 40 N*m passes the coupling; what is left is its fluctuation.
    assert 0.0 < loads["couplings.0.torque.max"] * ratio * share - 40.0 < 3.0 * own * ratio * share
    assert geared["torsion.torque.amplitude"] == pytest.approx(own, rel=1e-9)


def test_the_full_equations_of_motion_with_a_varying_inertia_give_the_same_torque() -> None:
    # Two bodies with the varying inertia of a Scotch yoke; the linear answer has its mean.
    spec = MachineSpec(
        drive=Drive(stages=("coupling",)), mechanism=MechanismChoice("scotch_yoke"),
        operation=OperationChoice("torque", "formula", formula="60 + 30*cos(phi)"),
    )  # fmt: skip
    radius, mass, stiff, first, last, speed = 0.1, 3.0, 2.2e3, 1.1, 2.0, 20.0
    numbers = {
        "mean_speed": speed, "drive.inertia": last, "drive.stages.0.stiffness": stiff, "drive.stages.0.inertia": first,
        "drive.stages.0.relative_damping": 0.3, "mechanism.scotch_yoke.crank": radius,
        "mechanism.scotch_yoke.yoke_mass": mass,
    }  # fmt: skip
    got = one(spec, numbers)
    assert got["inertia.mechanism.mean"] == pytest.approx(0.5 * mass * radius**2, rel=1e-9)
    # Viscous damping of the same share at the speed of the shaft.
    loss = 0.3 * stiff / (math.tau * speed)

    def slopes(_: float, state: Floats) -> Floats:
        front, back, fast, slow = state
        inertia = last + mass * (radius * math.sin(back)) ** 2
        varying = mass * radius**2 * math.sin(back) * math.cos(back)
        torque = stiff * (front - back) + loss * (fast - slow)
        resisting = 60.0 + 30.0 * math.cos(back) + varying * slow * slow
        # The mean speed is held by the mean torque and a weak correction by the speed.
        return np.array([fast, slow, (60.0 - 0.5 * (fast - speed) - torque) / first, (torque - resisting) / inertia])

    times = np.linspace(40.0, 40.0 + 4 * math.tau / speed, 4001)
    run = solve_ivp(slopes, (0.0, times[-1]), [60.0 / stiff, 0.0, speed, speed], "DOP853", times, rtol=1e-10)
    torque = stiff * (run.y[0] - run.y[1]) + loss * (run.y[2] - run.y[3])
    amplitude = 0.5 * (torque.max() - torque.min())
    assert got["torsion.torque.amplitude"] == pytest.approx(amplitude, rel=0.01)
    rigid = one(spec, numbers | {"drive.stages.0.stiffness": 1e9})
    assert got["torsion.torque.amplitude"] > 1.1 * rigid["torsion.torque.amplitude"]


def test_cases_do_not_depend_on_each_other_and_a_body_without_inertia_has_no_vibration() -> None:
    spec = replace(PRESS, drive=Drive(stages=("coupling", "coupling")))
    numbers = PRESS_NUMBERS | {
        "drive.stages.0.stiffness": 3e4, "drive.stages.0.inertia": np.array([0.5, 0.0, 2.0]),
        "drive.stages.1.stiffness": 1e5, "drive.stages.1.relative_damping": 0.2, "drive.stages.1.output_inertia": 0.3,
        "drive.stages.0.output_inertia": np.array([0.1, 0.2, 0.3]),
    }  # fmt: skip
    every = simulate(spec, numbers, cases=3).values
    for case in range(3):
        own = {path: value[case] if np.ndim(value) else value for path, value in numbers.items()}
        assert simulate(spec, own, cases=1).values[0].tobytes() == every[case].tobytes()
    vibration = [position for position, name in enumerate(NAMES) if name.startswith("torsion.")]
    assert np.isnan(every[1, vibration]).all()
    assert np.isfinite(every[np.ix_([0, 2], vibration)]).all()
    rigid = simulate(PRESS, PRESS_NUMBERS, cases=1).values
    assert np.isnan(rigid[0, vibration]).all()
