"""Odd drives by chance: exact equilibria, identical pendulums, clutches whose first coefficient locks them."""

from __future__ import annotations

import math

import numpy as np

from tests.engine.vibration_drive.drive import Columns, clutch


def odd_drive(rng: np.random.Generator, pendulums: int) -> Columns:
    """One drive; every one of so many pendulums has the same paths.

    Some pendulums stand exactly upright, which without horizontal vibration is an equilibrium; some are copies of
    another; c_1 is anything up to the largest moment M l d nu^2 of the vibration.
    """
    rate = 2.0 * math.pi * rng.uniform(10.0, 30.0)
    across = float(rng.choice([0.0, 0.0, rng.uniform(5e-4, 4e-3)]))
    along = float(rng.choice([0.0 if across else 2e-3, rng.uniform(5e-4, 6e-3)]))
    moment = 0.5 * 0.03 * max(across, along) * rate**2
    first = float(rng.choice([0.0, moment * rng.uniform(), moment * 10.0 ** rng.uniform(-3.0, 0.0)]))
    columns: Columns = {
        "excitation.frequency": rate / (2.0 * math.pi), "excitation.amplitude_x": across,
        "excitation.amplitude_y": along, "excitation.phase": float(rng.choice([0.0, rng.uniform(0.0, 6.28)])),
        "shaft.inertia": 10.0 ** rng.uniform(-4.0, -2.0),
        "shaft.load": float(rng.choice([0.0, 10.0 ** rng.uniform(-3.0, 0.0)])),
        "shaft.initial_speed": float(rng.choice([0.0, 0.0, 0.0, rng.uniform(0.0, 5.0)])),
        **clutch(first, 10.0 ** rng.uniform(0.0, 3.0), 0.0, float(rng.choice([0.0, 1e4]))),
    }  # fmt: skip
    moving = False
    for index in range(pendulums):
        upright = rng.random() < 0.4 and (moving or index < pendulums - 1)
        moving = moving or not upright
        own = {
            "inertia": 10.0 ** rng.uniform(-3.5, -2.5), "mass": 0.5, "arm": 0.03, "spring_arm": 0.05,
            "spring_rate": rng.uniform(6e3, 2e4), "damping": float(rng.choice([0.0, 0.01])),
            "backlash": float(rng.choice([0.0, 0.0, 0.005])),
            "initial_angle": 0.0 if upright else rng.uniform(-0.3, 0.3),
            "initial_speed": 0.0 if upright else float(rng.choice([0.0, rng.uniform(-5.0, 5.0)])),
        }  # fmt: skip
        if index > 0 and rng.random() < 0.2:
            own = {name: columns[f"pendulums.{index - 1}.{name}"] for name in own}
        columns |= {f"pendulums.{index}.{name}": value for name, value in own.items()}
    return columns


def idle_drive(rng: np.random.Generator, pendulums: int) -> tuple[Columns, int]:
    """An odd drive with one pendulum that nothing excites, and which that is; ``pendulums`` >= 2 counts it.

    It hangs at exactly 0 with mass or arm 0, so horizontal vibration does not move it either. The shaft never turns
    back, so its clutch stays out of all that happens.
    """
    columns = odd_drive(rng, pendulums - 1)
    if rng.random() < 0.7:
        columns["excitation.amplitude_x"] = rng.uniform(1e-3, 4e-3)
    place = int(rng.integers(pendulums))
    for index in reversed(range(place, pendulums - 1)):
        for name in [path.split(".")[2] for path in columns if path.startswith("pendulums.0.")]:
            columns[f"pendulums.{index + 1}.{name}"] = columns[f"pendulums.{index}.{name}"]
    own = {
        "inertia": 10.0 ** rng.uniform(-3.5, -2.0), "mass": 0.25, "arm": 0.03, "spring_arm": 0.05,
        "spring_rate": rng.uniform(6e3, 1e5), "damping": float(rng.choice([0.0, 0.03])),
        "backlash": float(rng.choice([0.0, 0.0, 0.005])), "initial_angle": 0.0, "initial_speed": 0.0,
    }  # fmt: skip
    own[str(rng.choice(["mass", "arm"]))] = 0.0
    return columns | {f"pendulums.{place}.{name}": value for name, value in own.items()}, place


def without(columns: Columns, place: int) -> Columns:
    """The same drive without one of its pendulums."""
    out: Columns = {}
    for path, value in columns.items():
        if not path.startswith("pendulums."):
            out[path] = value
            continue
        index, name = int(path.split(".")[1]), path.split(".")[2]
        if index != place:
            out[f"pendulums.{index - (index > place)}.{name}"] = value
    return out
