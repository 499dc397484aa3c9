"""Random machines of several parts of every kind, as plain data for the engine and for `independent`."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from tests.engine.machine_shaft.independent import TURN, MachineData, PartData, inertia, resistance


def random_machine(rng: np.random.Generator, *, geared: bool = False) -> MachineData:
    """A machine of two to five parts of any kind, with an even speed that no irregularity of its inertia stops.

    Where it is ``geared``, each part turns one to four times in a cycle.
    """
    cycle = int(rng.integers(1, 3))
    parts = [_random_part(rng, cycle) for _ in range(int(rng.integers(2, 6)))]
    for part in parts if geared else ():
        turns = int(rng.integers(1, 5))
        part.ratio = turns / cycle
        if part.operation == "step":
            back = part.load["from"] - part.load["from"] % (TURN * turns - 1.5)
            part.load |= {end: part.load[end] - back for end in ("from", "to")}
    probe = MachineData(parts, 0.0, 1.0, cycle)
    angles = np.linspace(0.0, TURN * cycle, 721)
    mechanisms = np.asarray(sum(inertia(part, angles) for part in parts))
    torque = np.asarray(sum(resistance(part, angles, probe) for part in parts))
    work = np.cumsum(torque - torque.mean()) * (angles[1] - angles[0])
    flywheel = float(rng.uniform(0.5, 3.0) * (np.ptp(mechanisms) + 0.1))
    speed = math.sqrt(float(np.ptp(work)) / (flywheel * float(rng.uniform(0.05, 0.3)))) + 1.0
    return MachineData(parts, flywheel, speed, cycle)


def _random_part(rng: np.random.Generator, cycle: int) -> PartData:
    kind = str(rng.choice(list(RANDOM)))
    part = PartData(kind, RANDOM[kind](rng), float(rng.uniform(-TURN, TURN)))
    choices = ["none", "step", "resisting"] + ([] if kind == "four_bar" else ["gas"])
    part.operation = str(rng.choice(choices))
    if part.operation == "step":
        low = float(rng.uniform(0.0, TURN * cycle - 1.5))
        part.load = {"from": low, "to": low + float(rng.uniform(0.2, 1.4)), "value": float(rng.uniform(-200.0, 800.0))}
    elif part.operation == "resisting":
        part.load = {"value": float(rng.uniform(100.0, 3000.0))}
    elif part.operation == "gas":
        part.load = {
            "piston_area": float(rng.uniform(2e-3, 2e-2)), "suction_pressure": 1e5, "back_pressure": 101325.0,
            "discharge_pressure": float(rng.uniform(2e5, 8e5)), "clearance": float(rng.uniform(0.03, 0.1)),
            "exponent": float(rng.uniform(1.1, 1.4)),
        }  # fmt: skip
    return part


def _rod(rng: np.random.Generator, length: float) -> dict[str, float]:
    return {
        "rod": length, "rod_centre": float(rng.uniform(0.2, 0.6)) * length, "rod_mass": float(rng.uniform(0.0, 5.0)),
        "rod_inertia": float(rng.uniform(0.0, 0.1)), "ram_mass": float(rng.uniform(0.5, 20.0)),
        "inclination": float(rng.uniform(-math.pi, math.pi)),
    }  # fmt: skip


def _random_slider_crank(rng: np.random.Generator) -> dict[str, float]:
    crank = float(rng.uniform(0.03, 0.2))
    rod = crank * float(rng.uniform(2.5, 5.0))
    return {"crank": crank, "offset": float(rng.uniform(-0.3, 0.3)) * (rod - crank), **_rod(rng, rod)}


def _random_quick_return(rng: np.random.Generator) -> dict[str, float]:
    crank = float(rng.uniform(0.05, 0.2))
    pivot = crank * float(rng.uniform(0.1, 0.5))
    return {
        "crank": crank, "pivot_distance": pivot, "link_arm": 0.8 * crank, "offset": 0.1 * crank,
        "link_inertia": float(rng.uniform(0.0, 0.5)), "block_mass": float(rng.uniform(0.0, 3.0)),
        **_rod(rng, 3.0 * crank),
    }  # fmt: skip


def _coupler(rng: np.random.Generator, length: float) -> dict[str, float]:
    return {
        "coupler": length, "coupler_centre": float(rng.uniform(0.2, 0.8)) * length,
        "coupler_mass": float(rng.uniform(0.0, 5.0)), "coupler_inertia": float(rng.uniform(0.0, 0.1)),
    }  # fmt: skip


def _random_four_bar(rng: np.random.Generator) -> dict[str, float]:
    crank = float(rng.uniform(0.03, 0.15))
    coupler, rocker = crank * float(rng.uniform(3.0, 4.0)), crank * float(rng.uniform(2.2, 2.8))
    return {
        "crank": crank, **_coupler(rng, coupler), "rocker": rocker, "frame": coupler * float(rng.uniform(0.95, 1.05)),
        "rocker_inertia": float(rng.uniform(0.0, 0.3)), "tray_mass": float(rng.uniform(0.0, 10.0)),
    }  # fmt: skip


def _random_drag_link(rng: np.random.Generator) -> dict[str, float]:
    frame = float(rng.uniform(0.03, 0.1))
    return {
        "frame": frame, "crank": frame * float(rng.uniform(2.0, 3.0)), **_coupler(rng, frame * 2.5),
        "follower": frame * float(rng.uniform(2.0, 3.0)), "follower_inertia": float(rng.uniform(0.0, 0.3)),
        "arm": frame, "frame_angle": float(rng.uniform(-3.0, 3.0)), "arm_angle": float(rng.uniform(-3.0, 3.0)),
        "offset": float(rng.uniform(-0.5, 0.5)) * frame, **_rod(rng, 4.0 * frame),
    }  # fmt: skip


def _random_toggle(rng: np.random.Generator) -> dict[str, float]:
    crank = float(rng.uniform(0.03, 0.08))
    rocker, frame, reach = 4.0 * crank, 5.5 * crank, 6.0 * crank
    last = math.pi - math.acos((frame**2 + rocker**2 - reach**2) / (2.0 * frame * rocker))
    return {
        "crank": crank, **_coupler(rng, 5.0 * crank), "rocker": rocker, "frame": frame,
        "line_angle": last - float(rng.uniform(0.05, 0.4)), "rocker_inertia": float(rng.uniform(0.0, 0.3)),
        **_rod(rng, 1.2 * rocker),
    }  # fmt: skip


def _random_scotch_yoke(rng: np.random.Generator) -> dict[str, float]:
    return {
        "crank": float(rng.uniform(0.03, 0.2)), "yoke_mass": float(rng.uniform(0.5, 20.0)),
        "block_mass": float(rng.uniform(0.0, 3.0)), "inclination": float(rng.uniform(-3.0, 3.0)),
    }  # fmt: skip


RANDOM: dict[str, Callable[[np.random.Generator], dict[str, float]]] = {
    "slider_crank": _random_slider_crank, "quick_return": _random_quick_return, "four_bar": _random_four_bar,
    "drag_link": _random_drag_link, "toggle": _random_toggle, "scotch_yoke": _random_scotch_yoke,
}  # fmt: skip
