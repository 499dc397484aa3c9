"""Mechanisms against kinematics by finite differences of positions that are found in another way, from circles."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from sprag_study.engine.machine_shaft.cams import Cam
from sprag_study.engine.machine_shaft.four_bars import FourBar, ParallelCrank
from sprag_study.engine.machine_shaft.linkages import CrankShaper, ScotchYoke, SliderCrank, Whitworth
from sprag_study.engine.machine_shaft.linked_rams import DragLink, Toggle
from sprag_study.engine.machine_shaft.mechanisms import Mechanism
from sprag_study.engine.machine_shaft.strokes import Stroke

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
#: A body: mass, inertia, and its centre and direction in the complex plane at the angles.
Bodies = list[tuple[float, float, Complex, Complex]]

ANGLES = np.linspace(0.1, 2.0 * math.pi + 0.1, 41)
STEP = 2e-3
_EIGHTH = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}


def slope(function: Callable[[Floats], NDArray], phi: Floats, step: float = STEP) -> NDArray:
    """Derivative by central differences of the eighth order."""
    total = sum(c * (function(phi + k * step) - function(phi - k * step)) for k, c in _EIGHTH.items())
    return np.asarray(total / step)


def inertia(bodies: Callable[[Floats], Bodies], phi: Floats) -> Floats:
    """Reduced inertia from positions."""
    total = np.zeros(len(phi))
    for k, (mass, own, _, direction) in enumerate(bodies(phi)):
        speed = slope(lambda p, k=k: bodies(p)[k][2], phi)
        turning = slope(lambda p, k=k: bodies(p)[k][3], phi)
        total += mass * np.abs(speed) ** 2 + own * np.imag(np.conj(direction) * turning) ** 2
    return total


def arrays(values: Mapping[str, float]) -> dict[str, Floats]:
    return {name: np.array(value, dtype=np.float64).reshape(1, 1, 1) for name, value in values.items()}


def compare(
    mechanism: Mechanism, v: Mapping[str, float], bodies: Callable[[Floats], Bodies], way: Callable[[Floats], Floats]
) -> None:
    values = arrays(v)
    assert np.isnan(mechanism.unassembled(values)[0])
    motion = mechanism.motion(values, ANGLES[None, None, :])
    assert (mechanism.way(values, ANGLES[None, None, :]) == motion.way).all()
    got = np.broadcast_to(motion.inertia, (1, 1, len(ANGLES)))[0, 0]
    wanted = inertia(bodies, ANGLES)
    assert np.max(np.abs(got - wanted)) <= 1e-8 * np.max(np.abs(wanted))

    def own_inertia(phi: Floats) -> Floats:
        return np.broadcast_to(mechanism.motion(values, phi[None, None, :]).inertia, (1, 1, len(phi)))[0, 0]

    own_slope = motion.inertia_slope[0, 0]
    assert np.max(np.abs(own_slope - slope(own_inertia, ANGLES))) <= 1e-8 * np.max(np.abs(wanted) + np.abs(own_slope))
    size = np.max(np.abs(way(ANGLES)))
    assert np.max(np.abs(motion.way_slope[0, 0] - slope(way, ANGLES))) <= 1e-8 * size
    stroke = Stroke.of(mechanism, values)
    start, end = stroke.start.ravel(), stroke.end.ravel()
    assert motion.way[0, 0] == pytest.approx(way(ANGLES) - way(start), abs=1e-11 * size)
    # The dead centres are the ends of the way, and the stroke between them is a forward one.
    dense = mechanism.motion(values, np.linspace(0.0, 2.0 * math.pi, 721)[None, None, :]).way
    assert dense.min() >= -1e-11 * size
    assert dense.max() <= stroke.length[0, 0, 0] * (1 + 1e-9)
    assert slope(way, start)[0] == pytest.approx(0.0, abs=1e-8 * size)
    assert slope(way, end)[0] == pytest.approx(0.0, abs=1e-8 * size)


def rod_and_ram(v: Mapping[str, float], pin: Complex, line: float) -> tuple[Bodies, Floats]:
    ram = pin.real + np.sqrt(v["rod"] ** 2 - (pin.imag - line) ** 2) + 1j * line
    rod = (ram - pin) / v["rod"]
    bodies = [(v["rod_mass"], v["rod_inertia"], pin + v["rod_centre"] * rod, rod), (v["ram_mass"], 0.0, ram, rod)]
    return bodies, ram.real


MASSES = st.fixed_dictionaries(
    {"rod_mass": st.floats(0.0, 20.0), "rod_inertia": st.floats(0.0, 1.0), "ram_mass": st.floats(0.1, 100.0)}
)


@given(crank=st.floats(0.02, 0.5), ratio=st.floats(1.5, 8.0), offset=st.floats(-0.3, 0.3), at=st.floats(0, 1), m=MASSES)
@settings(max_examples=15, deadline=None)
def test_slider_crank(crank: float, ratio: float, offset: float, at: float, m: dict[str, float]) -> None:
    rod = crank * ratio
    v = {"crank": crank, "rod": rod, "offset": offset * (rod - crank), "rod_centre": at * rod, **m}

    def parts(phi: Floats) -> tuple[Bodies, Floats]:
        return rod_and_ram(v, crank * np.exp(1j * phi), v["offset"])

    compare(SliderCrank(), v, lambda p: parts(p)[0], lambda p: -parts(p)[1])


@given(
    crank=st.floats(0.05, 0.3), extra=st.tuples(*[st.floats(0.02, 0.3)] * 3), at=st.floats(-0.5, 1.5),
    masses=st.tuples(*[st.floats(0.1, 10.0)] * 4),
)  # fmt: skip
@settings(max_examples=15, deadline=None)
def test_four_bar(crank: float, extra: tuple[float, ...], at: float, masses: tuple[float, float, float, float]) -> None:
    # A crank-rocker with angles of transmission that stay away from 0: lengths from Grashof's rule with a reserve.
    rocker, coupler = crank * 2.0 + extra[0], crank * 2.0 + extra[1]
    frame = min(rocker + coupler - 1.3 * crank, max(rocker, coupler) * 0.9 + crank)
    v = {
        "crank": crank, "coupler": coupler, "rocker": rocker, "frame": frame, "coupler_centre": at * coupler,
        "coupler_mass": masses[0], "coupler_inertia": masses[1], "rocker_inertia": masses[2], "tray_mass": masses[3],
    }  # fmt: skip

    def pin(phi: Floats) -> tuple[Complex, Complex]:
        driven = crank * np.exp(1j * phi)
        gap = frame - driven
        distance = np.abs(gap)
        along = (coupler**2 - rocker**2 + distance**2) / (2.0 * distance)
        return driven, driven + gap / distance * (along + 1j * np.sqrt(coupler**2 - along**2))

    def bodies(phi: Floats) -> Bodies:
        driven, end = pin(phi)
        link, swing = (end - driven) / coupler, (end - frame) / rocker
        centre = driven + v["coupler_centre"] * link
        return [(masses[0], masses[1], centre, link), (masses[3], masses[2], end, swing)]

    compare(FourBar(), v, bodies, lambda p: -rocker * np.unwrap(np.angle(pin(p)[1] - frame)))


@given(crank=st.floats(0.05, 0.3), far=st.floats(1.5, 4.0), arm=st.floats(0.8, 2.0), m=MASSES, link=st.floats(0, 5))
@settings(max_examples=15, deadline=None)
def test_crank_shaper(crank: float, far: float, arm: float, m: dict[str, float], link: float) -> None:
    pivot = crank * far
    length = pivot * arm
    v = {
        "crank": crank, "pivot_distance": pivot, "link_arm": length, "rod": 0.8 * length, "offset": 0.95 * length,
        "rod_centre": 0.3 * length, "link_inertia": link, "block_mass": 2.0, **m,
    }  # fmt: skip
    compare_quick_return(CrankShaper(), v)


@given(crank=st.floats(0.05, 0.3), near=st.floats(0.1, 0.7), m=MASSES, link=st.floats(0, 5), off=st.floats(-0.4, 0.4))
@settings(max_examples=15, deadline=None)
def test_whitworth(crank: float, near: float, m: dict[str, float], link: float, off: float) -> None:
    v = {
        "crank": crank, "pivot_distance": near * crank, "link_arm": 0.7 * crank, "rod": 2.5 * crank,
        "offset": off * crank, "rod_centre": crank, "link_inertia": link, "block_mass": 1.0, **m,
    }  # fmt: skip
    compare_quick_return(Whitworth(), v)


def compare_quick_return(mechanism: Mechanism, v: dict[str, float]) -> None:
    def parts(phi: Floats) -> tuple[Bodies, Floats]:
        block = v["crank"] * np.exp(1j * phi)
        link = (block + 1j * v["pivot_distance"]) / np.abs(block + 1j * v["pivot_distance"])
        bodies, ram = rod_and_ram(v, v["link_arm"] * link, v["offset"])
        return [*bodies, (0.0, v["link_inertia"], 0.0 * link, link), (v["block_mass"], 0.0, block, link)], ram

    compare(mechanism, v, lambda p: parts(p)[0], lambda p: -parts(p)[1])


@pytest.mark.parametrize("rise", ["cycloidal", "polynomial_345"])
@pytest.mark.parametrize("fall", ["cycloidal", "polynomial_345"])
def test_cam(rise: str, fall: str) -> None:
    v = {
        "lift": 0.03, "start": 0.4, "rise_angle": 2.0, "dwell_angle": 0.7, "fall_angle": 1.6, "follower_mass": 3.0,
    }  # fmt: skip

    def law(name: str, u: Floats) -> Floats:
        u = np.clip(u, 0.0, 1.0)
        return u - np.sin(2 * np.pi * u) / (2 * np.pi) if name == "cycloidal" else 10 * u**3 - 15 * u**4 + 6 * u**5

    def way(phi: Floats) -> Floats:
        angle = np.mod(phi - v["start"], 2.0 * np.pi)
        return v["lift"] * (law(rise, angle / 2.0) - law(fall, (angle - 2.7) / 1.6))

    cam = Cam(rise, fall)  # type: ignore[arg-type]
    values = arrays(v)
    edges = v["start"] + np.array([0.0, 2.0, 2.7, 4.3])
    phi = np.array([p for p in ANGLES if np.min(np.abs(np.mod(p, 2 * np.pi) - edges)) > 5 * STEP])
    motion = cam.motion(values, phi[None, None, :])
    assert motion.way[0, 0] == pytest.approx(way(phi), abs=1e-15)
    assert motion.way_slope[0, 0] == pytest.approx(slope(way, phi), abs=1e-12)
    assert motion.inertia[0, 0] == pytest.approx(3.0 * slope(way, phi) ** 2, abs=1e-13)

    def own(p: Floats) -> Floats:
        return cam.motion(values, p[None, None, :]).inertia[0, 0]

    assert motion.inertia_slope[0, 0] == pytest.approx(slope(own, phi), abs=1e-12)
    assert np.max(np.abs(cam.motion(values, edges[None, None, :]).way_slope)) < 1e-15


def test_angles_of_a_fraction_of_the_stroke() -> None:
    values = arrays({
        "crank": 0.1, "rod": 0.35, "offset": 0.04, "rod_centre": 0, "rod_mass": 0, "rod_inertia": 0, "ram_mass": 1,
    })  # fmt: skip
    stroke = Stroke.of(SliderCrank(), values)
    asked = np.linspace(0.02, 0.98, 25)[None, None, :]
    for forward in (True, False):
        angles = stroke.angles(asked, forward=forward)
        assert stroke.fraction(angles) == pytest.approx(asked, abs=1e-14)
        assert np.all(stroke.forward(angles) == forward)
    assert np.isnan(stroke.angles(np.array([[[-0.1, 1.2]]]), forward=True)).all()


@given(crank=st.floats(0.02, 0.5), masses=st.tuples(*[st.floats(0.1, 50.0)] * 2))
@settings(max_examples=5, deadline=None)
def test_scotch_yoke(crank: float, masses: tuple[float, float]) -> None:
    v = {"crank": crank, "yoke_mass": masses[0], "block_mass": masses[1], "inclination": 0.0}

    def bodies(phi: Floats) -> Bodies:
        pin = crank * np.exp(1j * phi)
        return [(masses[0], 0.0, pin.real + 0j, 1.0 + 0.0 * pin), (masses[1], 0.0, pin, 1.0 + 0.0 * pin)]

    compare(ScotchYoke(), v, bodies, lambda p: -crank * np.cos(p))


@given(crank=st.floats(0.02, 0.5), masses=st.tuples(*[st.floats(0.1, 50.0)] * 2))
@settings(max_examples=5, deadline=None)
def test_parallel_crank(crank: float, masses: tuple[float, float]) -> None:
    v = {"crank": crank, "coupler_mass": masses[0], "driven_inertia": masses[1], "inclination": 0.0}

    def bodies(phi: Floats) -> Bodies:
        pin = crank * np.exp(1j * phi)
        return [(masses[0], 0.0, pin, 1.0 + 0.0 * pin), (0.0, masses[1], 0.0 * pin, pin / crank)]

    compare(ParallelCrank(), v, bodies, lambda p: -crank * np.cos(p))


def four_bar_pins(v: Mapping[str, float], third: str, phi: Floats) -> tuple[Complex, Complex]:
    """Crank pin, and the pin between coupler and third link."""
    driven = v["crank"] * np.exp(1j * phi)
    gap = v["frame"] - driven
    distance = np.abs(gap)
    along = (v["coupler"] ** 2 - v[third] ** 2 + distance**2) / (2.0 * distance)
    return driven, driven + gap / distance * (along + 1j * np.sqrt(v["coupler"] ** 2 - along**2))


def of_links(v: Mapping[str, float], third: str, phi: Floats) -> tuple[Bodies, Complex]:
    """Coupler and third link, and the direction of the latter."""
    driven, end = four_bar_pins(v, third, phi)
    link, swing = (end - driven) / v["coupler"], (end - v["frame"]) / v[third]
    coupler = (v["coupler_mass"], v["coupler_inertia"], driven + v["coupler_centre"] * link, link)
    return [coupler, (0.0, v[f"{third}_inertia"], 0.0 * swing, swing)], swing


LINK_MASSES = st.fixed_dictionaries(
    {"coupler_mass": st.floats(0.0, 20.0), "coupler_inertia": st.floats(0.0, 1.0), "third": st.floats(0.0, 3.0)}
)


@given(
    frame=st.floats(0.03, 0.2), ratios=st.tuples(*[st.floats(2.0, 3.0)] * 3), angles=st.tuples(*[st.floats(-3, 3)] * 2),
    links=LINK_MASSES, m=MASSES,
)  # fmt: skip
@settings(max_examples=15, deadline=None)
def test_drag_link(
    frame: float, ratios: tuple[float, ...], angles: tuple[float, float], links: dict[str, float], m: dict[str, float]
) -> None:
    crank, coupler, follower = (frame * ratio for ratio in ratios)
    v = {
        "frame": frame, "crank": crank, "coupler": coupler, "follower": follower, "arm": 1.5 * frame,
        "rod": 6.0 * frame, "offset": 0.5 * frame, "frame_angle": angles[0], "arm_angle": angles[1],
        "coupler_centre": 0.4 * coupler,
        "coupler_mass": links["coupler_mass"], "coupler_inertia": links["coupler_inertia"],
        "follower_inertia": links["third"], "rod_centre": frame, **m,
    }  # fmt: skip

    def parts(phi: Floats) -> tuple[Bodies, Floats]:
        bodies, swing = of_links(v, "follower", phi - angles[0])
        rest, ram = rod_and_ram(v, 1.5 * frame * swing * np.exp(1j * sum(angles)), v["offset"])
        return [*bodies, *rest], ram

    compare(DragLink(), v, lambda p: parts(p)[0], lambda p: -parts(p)[1])


@given(crank=st.floats(0.03, 0.1), spare=st.floats(0.02, 0.6), rod=st.floats(1.0, 1.6), links=LINK_MASSES, m=MASSES)
@settings(max_examples=15, deadline=None)
def test_toggle(crank: float, spare: float, rod: float, links: dict[str, float], m: dict[str, float]) -> None:
    coupler, rocker, frame = 5.0 * crank, 4.0 * crank, 5.5 * crank
    v = {
        "frame": frame, "crank": crank, "coupler": coupler, "rocker": rocker, "rod": rod * rocker,
        "coupler_centre": 0.4 * coupler, "coupler_mass": links["coupler_mass"],
        "coupler_inertia": links["coupler_inertia"], "rocker_inertia": links["third"], "rod_centre": 0.3 * rocker, **m,
    }  # fmt: skip
    # The links are nearly straight at the end of the stroke.
    reach = coupler + crank
    last = math.pi - math.acos((frame**2 + rocker**2 - reach**2) / (2.0 * frame * rocker))
    v["line_angle"] = last - spare

    def parts(phi: Floats) -> tuple[Bodies, Floats]:
        bodies, swing = of_links(v, "rocker", phi)
        rest, ram = rod_and_ram(v | {"offset": 0.0}, rocker * swing * np.exp(-1j * v["line_angle"]), 0.0)
        return [*bodies, *rest], ram

    compare(Toggle(), v, lambda p: parts(p)[0], lambda p: parts(p)[1])


@pytest.mark.parametrize(
    ("mechanism", "numbers", "reason"),
    [
        (FourBar(), {"crank": 0.2, "coupler": 0.5, "rocker": 0.2, "frame": 0.5}, "a parallel_crank"),
        (FourBar(), {"crank": 0.3, "coupler": 0.35, "rocker": 0.32, "frame": 0.1}, "turn fully: a drag_link"),
        (FourBar(), {"crank": 0.1, "coupler": 0.3, "rocker": 0.2, "frame": 0.2}, "could continue either way"),
        (
            DragLink(),
            {"crank": 0.3, "coupler": 0.35, "follower": 0.32, "frame": 0.33},
            "must be shorter than the crank",
        ),
        (DragLink(), {"crank": 0.3, "coupler": 0.3, "follower": 0.4, "frame": 0.2}, "could continue either way"),
        (DragLink(), {"crank": 0.3, "coupler": 0.3, "follower": 0.5, "frame": 0.2}, "cannot turn fully"),
        (DragLink(), {"crank": 0.3, "coupler": 0.35, "follower": 0.32, "frame": 0.1, "rod": 0.2, "arm": 0.3}, None),
        (DragLink(), {"crank": 0.3, "coupler": 0.35, "follower": 0.32, "frame": 0.1, "rod": 0.3, "arm": 0.3}, "folds"),
        (Toggle(), {"crank": 0.05, "coupler": 0.25, "rocker": 0.2, "frame": 0.28, "line_angle": 2.0}, "turn back"),
        (Toggle(), {"crank": 0.3, "coupler": 0.25, "rocker": 0.2, "frame": 0.28}, "crank-rocker must be shorter"),
        (Toggle(), {"crank": 0.05, "coupler": 0.25, "rocker": 0.2, "frame": 0.28, "rod": 0.05}, "does not reach"),
    ],
)
def test_what_cannot_be_assembled_is_given_its_reason(
    mechanism: Mechanism, numbers: dict[str, float], reason: str | None
) -> None:
    rest = {"frame_angle": 0.0, "arm_angle": 0.0, "arm": 0.1, "rod": 0.5, "offset": 0.0, "line_angle": 0.0}
    values = arrays(rest | numbers)
    assert not np.isnan(mechanism.unassembled(values)[0])
    told = mechanism.broken_rule(values)
    assert told is None if reason is None else reason in str(told)
