"""Sketches against the engine's own motion: links keep their lengths, and the working part is where its way says."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.machine import Machine
from sprag_study.engine.machine_shaft.sketch import Sketch
from sprag_study.engine.machine_shaft.sketches import sketches
from sprag_study.engine.machine_shaft.spec import MachineSpec, MechanismChoice, PartChoice
from tests.engine.machine_shaft.random_machines import RANDOM

ANGLES = np.linspace(0.0, 2.0 * math.pi, 73)
SLOPE = 0.4
#: Joint of the working part of each mechanism.
WORKING = {
    "slider_crank": "ram", "quick_return": "ram", "drag_link": "ram", "toggle": "ram", "scotch_yoke": "yoke",
    "parallel_crank": "pin", "cam": "tip",
}  # fmt: skip

FIXED = {
    "cam": {"lift": 0.02, "start": 0.3, "rise_angle": 1.5, "dwell_angle": 1.0, "fall_angle": 1.2},
    "parallel_crank": {"crank": 0.1},
}


def drawn(kind: str, numbers: dict[str, float], **chosen: Any) -> tuple[Sketch, np.ndarray]:
    """The only sketch of a machine with a mechanism of that kind, and its way over the same angles."""
    spec = MachineSpec(mechanism=MechanismChoice(kind, **chosen))  # type: ignore[arg-type]
    paths = {f"mechanism.{kind}.{name}": value for name, value in numbers.items()}
    given = {"mean_speed": 1.0, "drive.inertia": 1.0, **paths}
    motion = Machine(spec, Columns.of(spec, given, 1)).parts[0].motion(ANGLES.reshape(1, 1, -1))
    way = np.zeros(len(ANGLES)) if motion is None else np.broadcast_to(motion.way, (1, 1, len(ANGLES))).reshape(-1)
    (sketch,) = sketches(spec, given, ANGLES)
    return sketch, way


@pytest.mark.parametrize("kind", [*RANDOM, *FIXED])
def test_links_keep_their_lengths_and_the_working_part_its_way(kind: str) -> None:
    rng = np.random.default_rng(11)
    for _ in range(5):
        numbers = dict(RANDOM[kind](rng) if kind in RANDOM else FIXED[kind])
        if kind != "four_bar":
            numbers["inclination"] = SLOPE
        chosen = {"quick_return": "whitworth"} if kind == "quick_return" else {}
        sketch, way = drawn(kind, numbers, **chosen)
        for bar in sketch.bars:
            ends = [sketch.joints[name] for name in bar.joints]
            length = np.hypot(*(ends[1] - ends[0]).T)
            assert length == pytest.approx(length[0], abs=1e-12)
            if bar.about and bar.about[0] in numbers and bar.about[0] != "link_arm":
                assert length[0] == pytest.approx(numbers[bar.about[0]], rel=1e-12)
        pins = sketch.joints.get("pin")
        if pins is not None:  # the crank turns counterclockwise
            turned = np.unwrap(np.arctan2(pins[:, 1], pins[:, 0]))
            assert turned[-1] - turned[0] == pytest.approx(2.0 * math.pi)
        if kind == "four_bar":
            arc = sketch.joints["rocker"] - sketch.joints["pivot"]
            swing = np.unwrap(np.arctan2(arc[:, 1], arc[:, 0]))
            assert np.ptp(swing) * numbers["rocker"] == pytest.approx(np.ptp(way), rel=1e-12)
        else:  # the forward stroke rises by the inclination
            moved = sketch.joints[WORKING[kind]] - sketch.joints[WORKING[kind]][0]
            along = moved @ _forward(kind)
            assert along == pytest.approx(way - way[0], abs=1e-12)


def _forward(kind: str) -> np.ndarray:
    """Direction of the forward stroke in the sketch: to the left where it comes nearer to the shaft."""
    side = 1.0 if kind in {"toggle", "cam"} else -1.0
    return np.array([side * math.cos(SLOPE), math.sin(SLOPE)])


def test_the_outline_of_a_cam_touches_its_follower() -> None:
    sketch, _ = drawn("cam", FIXED["cam"])
    cam = sketch.plates[0]
    radii, directions = np.hypot(*cam.outline.T), np.arctan2(cam.outline[:, 1], cam.outline[:, 0])
    order = np.argsort(np.mod(directions, 2.0 * math.pi))
    for index in range(len(ANGLES)):
        tip = sketch.joints["tip"][index]
        towards = math.atan2(tip[1], tip[0]) - sketch.turns["cam"][index]
        radius = np.interp(towards % (2.0 * math.pi), np.mod(directions, 2.0 * math.pi)[order], radii[order])
        assert radius == pytest.approx(math.hypot(*tip), rel=2e-3)


def test_every_part_has_a_sketch_at_its_crank_angle_even_without_dimensions() -> None:
    parts = (PartChoice(MechanismChoice("scotch_yoke")), PartChoice(MechanismChoice("formula", formula="1")))
    numbers = {"parts.0.mechanism.scotch_yoke.crank": 0.1, "parts.1.crank_angle": 2.0}
    first, second = sketches(MachineSpec(parts=parts), {"mean_speed": 1.0, "drive.inertia": 1.0, **numbers}, ANGLES)
    assert first.joints["pin"][0] == pytest.approx([0.1, 0.0])
    assert second.turns["disc"] == pytest.approx(ANGLES + 2.0)


def test_links_that_do_not_reach_each_other_have_no_place() -> None:
    sketch, _ = drawn("slider_crank", {"crank": 0.2, "rod": 0.1})
    assert np.isnan(sketch.joints["ram"]).any()
