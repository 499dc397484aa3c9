"""Machines of several parts computed in another way: complex steps through positions, own quadrature, own root search.

Nothing of the engine is used: a machine is plain data (`random_machines` makes some), and `solve` gives the results
that a test compares. Velocities are imaginary parts of positions at complex angles, so none is derived by hand.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

Array = NDArray[Any]
TURN = 2.0 * math.pi
_STEP = 1e-30
#: Local maxima among the samples are refined if they are this close to the largest, as a share of the range.
_NEAR = 1e-2
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


@dataclass
class PartData:
    """A mechanism with its dimensions, and an operation with its numbers, at a crank angle (rad).

    ``ratio`` is the speed of its shaft over that of the main shaft.
    """

    kind: str
    dimensions: dict[str, float]
    angle: float
    operation: str = "none"
    load: dict[str, float] = field(default_factory=dict)
    ratio: float = 1.0


@dataclass
class MachineData:
    """Parts on a shaft with an inertia (kg*m^2), a mean speed (midrange, rad/s) and the revolutions of a cycle."""

    parts: list[PartData]
    inertia: float
    speed: float
    cycle: int
    gravity: float = 9.80665


#: Mass, inertia, and at each angle the centre's x and y and a direction (x, y) fixed to the body.
Body = tuple[float, float, Array, Array, Array, Array]


def _rod_and_ram(v: dict[str, float], x: Array, y: Array) -> tuple[list[Body], Array]:
    """Rod and ram of a pin at (x, y), and the ram's place."""
    along = np.sqrt(v["rod"] ** 2 - (y - v["offset"]) ** 2)
    cos, sin = along / v["rod"], (v["offset"] - y) / v["rod"]
    ram = x + along
    rod = (v["rod_mass"], v["rod_inertia"], x + v["rod_centre"] * cos, y + v["rod_centre"] * sin, cos, sin)
    return [rod, (v["ram_mass"], 0.0, ram, v["offset"] + 0.0 * y, 1.0 + 0.0 * x, 0.0 * x)], ram


def _slider_crank(v: dict[str, float], p: Array) -> tuple[list[Body], Array]:
    bodies, ram = _rod_and_ram(v, v["crank"] * np.cos(p), v["crank"] * np.sin(p))
    return bodies, -ram


def _quick_return(v: dict[str, float], p: Array) -> tuple[list[Body], Array]:
    x, y = v["crank"] * np.cos(p), v["crank"] * np.sin(p)
    length = np.sqrt(x**2 + (y + v["pivot_distance"]) ** 2)
    cos, sin = x / length, (y + v["pivot_distance"]) / length
    bodies, ram = _rod_and_ram(v, v["link_arm"] * cos, v["link_arm"] * sin)
    link = (0.0, v["link_inertia"], 0.0 * x, 0.0 * x, cos, sin)
    return [*bodies, link, (v["block_mass"], 0.0, x, y, cos, sin)], -ram


def _links(v: dict[str, float], third: str, p: Array) -> tuple[list[Body], Array, Array]:
    """Coupler and third link of a four-bar, and the direction of the latter."""
    x, y = v["crank"] * np.cos(p), v["crank"] * np.sin(p)
    gap_x, gap_y = v["frame"] - x, -y
    distance = np.sqrt(gap_x**2 + gap_y**2)
    along = (v["coupler"] ** 2 - v[third] ** 2 + distance**2) / (2.0 * distance)
    across = np.sqrt(v["coupler"] ** 2 - along**2)
    pin_x = x + (gap_x * along - gap_y * across) / distance
    pin_y = y + (gap_y * along + gap_x * across) / distance
    cos, sin = (pin_x - x) / v["coupler"], (pin_y - y) / v["coupler"]
    s = v["coupler_centre"]
    coupler = (v["coupler_mass"], v["coupler_inertia"], x + s * cos, y + s * sin, cos, sin)
    swing = ((pin_x - v["frame"]) / v[third], pin_y / v[third])
    return [coupler, (v.get("tray_mass", 0.0), v[f"{third}_inertia"], pin_x, pin_y, *swing)], *swing


def _four_bar(v: dict[str, float], p: Array) -> tuple[list[Body], Array]:
    """The way is no position but the arc: its derivative is taken of the direction, in `way_slope`."""
    return _links(v, "rocker", p)[0], 0.0 * p


def _turned(cos: Array, sin: Array, angle: float) -> tuple[Array, Array]:
    return cos * math.cos(angle) - sin * math.sin(angle), sin * math.cos(angle) + cos * math.sin(angle)


def _drag_link(v: dict[str, float], p: Array) -> tuple[list[Body], Array]:
    bodies, *swing = _links(v, "follower", p - v["frame_angle"])
    cos, sin = _turned(*swing, v["frame_angle"] + v["arm_angle"])
    rest, ram = _rod_and_ram(v, v["arm"] * cos, v["arm"] * sin)
    return [*bodies, *rest], -ram


def _toggle(v: dict[str, float], p: Array) -> tuple[list[Body], Array]:
    bodies, *swing = _links(v, "rocker", p)
    cos, sin = _turned(*swing, -v["line_angle"])
    rest, ram = _rod_and_ram(v | {"offset": 0.0}, v["rocker"] * cos, v["rocker"] * sin)
    return [*bodies, *rest], ram


def _scotch_yoke(v: dict[str, float], p: Array) -> tuple[list[Body], Array]:
    x, y = v["crank"] * np.cos(p), v["crank"] * np.sin(p)
    still = (1.0 + 0.0 * p, 0.0 * p)
    return [(v["yoke_mass"], 0.0, x, 0.0 * p, *still), (v["block_mass"], 0.0, x, y, *still)], -x


_POSITIONS: dict[str, Callable[[dict[str, float], Array], tuple[list[Body], Array]]] = {
    "slider_crank": _slider_crank, "quick_return": _quick_return, "four_bar": _four_bar, "drag_link": _drag_link,
    "toggle": _toggle, "scotch_yoke": _scotch_yoke,
}  # fmt: skip


def _turning(body: Body) -> Array:
    """Angular velocity of a body per that of the shaft."""
    cos, sin = body[4], body[5]
    return np.asarray((cos.real * sin.imag - sin.real * cos.imag) / _STEP)


def inertia(part: PartData, phi: Array) -> Array:
    """Reduced inertia of a part at angles of the shaft, kg*m^2."""
    bodies, _ = _POSITIONS[part.kind](part.dimensions, part.ratio * (phi + 1j * _STEP) + part.angle)
    total = np.zeros(phi.shape)
    for body in bodies:
        mass, own, x, y = body[:4]
        total += mass * (x.imag**2 + y.imag**2) / _STEP**2 + own * _turning(body) ** 2
    return total


def way_slope(part: PartData, phi: Array) -> Array:
    """Travel of the working part per angle, in m/rad."""
    bodies, way = _POSITIONS[part.kind](part.dimensions, part.ratio * (phi + 1j * _STEP) + part.angle)
    if part.kind == "four_bar":
        return np.asarray(-part.dimensions["rocker"] * _turning(bodies[1]))
    return np.asarray(way.imag / _STEP)


def lift(part: PartData, phi: Array) -> Array:
    """Sum of m dh/dphi of all bodies: the heights of their centres above the level, kg*m.

    The coupler of a drag link or a toggle has coordinates along the frame, everything else along the ram's line.
    """
    v, beta = part.dimensions, part.dimensions["inclination"]
    bodies, _ = _POSITIONS[part.kind](v, part.ratio * (phi + 1j * _STEP) + part.angle)
    # The direction of "up" for positions that count from the ram's line, and from the frame.
    inward = part.kind not in {"toggle", "four_bar"}
    up = (-math.sin(beta) if inward else math.sin(beta)) + 1j * math.cos(beta)
    tilt = {"drag_link": v.get("frame_angle", 0.0), "toggle": -v.get("line_angle", 0.0)}.get(part.kind, 0.0)
    total = np.zeros(phi.shape)
    for index, body in enumerate(bodies):
        mass, _, x, y = body[:4]
        turned = up * np.exp(-1j * tilt) if index == 0 and tilt else up
        total += mass * (x.imag * turned.real + y.imag * turned.imag) / _STEP
    return total


def _gas(part: PartData, phi: Array) -> Array:
    """Pressure on the piston of a compressor above that on its back, Pa."""
    load, stroke = part.load, _stroke(part)
    way = _POSITIONS[part.kind](part.dimensions, part.ratio * phi + part.angle + 0j)[1].real
    x, c, n = np.clip((way - stroke[0]) / (stroke[1] - stroke[0]), 0.0, 1.0), load["clearance"], load["exponent"]
    expanding = np.maximum(load["suction_pressure"], load["discharge_pressure"] * (c / (c + x)) ** n)
    compressing = np.minimum(load["discharge_pressure"], load["suction_pressure"] * ((1.0 + c) / (c + x)) ** n)
    return np.asarray(np.where(way_slope(part, phi) > 0.0, expanding, compressing) - load["back_pressure"])


def _stroke(part: PartData) -> tuple[float, float]:
    """Least and largest travel of the working part."""
    ends = [
        _POSITIONS[part.kind](part.dimensions, np.array([part.ratio * z + part.angle + 0j]))[1].real[0]
        for z in dead(part)
    ]
    return min(ends), max(ends)


def dead(part: PartData) -> list[float]:
    """Angles of the main shaft, in the first turn of the part, at which its working part turns back."""
    return _zeros(lambda phi: way_slope(part, phi), TURN / part.ratio)


def _zeros(function: Callable[[Array], Array], end: float) -> list[float]:
    grid = np.linspace(0.0, end, 721) + 1e-5
    values = function(grid)
    changes = np.nonzero(np.sign(values[1:]) != np.sign(values[:-1]))[0]
    return [brentq(lambda p: float(function(np.array([p]))[0]), grid[k], grid[k + 1], xtol=1e-15) for k in changes]


def resistance(part: PartData, phi: Array, machine: MachineData) -> Array:
    """Torque of a part on the shaft, N*m."""
    slope, load = way_slope(part, phi), part.load
    torque = np.zeros(phi.shape)
    if "inclination" in part.dimensions:
        ram = part.dimensions.get("ram_mass", part.dimensions.get("yoke_mass", 0.0))
        weight = ram * machine.gravity * math.sin(part.dimensions["inclination"])
        torque -= weight * slope
    if part.operation == "step":
        own = np.mod(part.ratio * phi + part.angle - load["from"], TURN * part.ratio * machine.cycle)
        torque -= part.ratio * np.where(own < load["to"] - load["from"], load["value"], 0.0)
    elif part.operation == "resisting":
        torque -= load["value"] * np.abs(slope)
    elif part.operation == "gas":
        torque += _gas(part, phi) * load["piston_area"] * slope
    return torque


def _cuts(machine: MachineData) -> Array:
    """Angles between which inertia and torques are smooth."""
    end, fastest = TURN * machine.cycle, max(1, *(math.ceil(part.ratio) for part in machine.parts))
    cuts = [np.linspace(0.0, end, 72 * fastest * machine.cycle + 1)]
    for part in machine.parts:
        own: list[float] = []
        if part.operation in {"resisting", "gas"}:
            own += dead(part)
        if part.operation == "gas":
            load, (low, high) = part.load, _stroke(part)
            ratio = (load["discharge_pressure"] / load["suction_pressure"]) ** (1.0 / load["exponent"])
            c = load["clearance"]
            for x in (c * (ratio - 1.0), (1.0 + c) / ratio - c):
                place = low + x * (high - low)
                own += _zeros(lambda p, part=part, place=place: _POSITIONS[part.kind](
                    part.dimensions, part.ratio * p + part.angle + 0j)[1].real - place,
                    TURN / part.ratio)  # fmt: skip
        turns = range(round(part.ratio * machine.cycle))
        cuts += [np.array([angle + TURN / part.ratio * k for angle in own for k in turns])]
        if part.operation == "step":
            cuts += [np.mod((np.array([part.load["from"], part.load["to"]]) - part.angle) / part.ratio, end)]
    return np.unique(np.clip(np.concatenate(cuts), 0.0, end))


def solve(machine: MachineData) -> dict[str, float]:
    """Results of the machine with a constant driving torque that balances the resistance."""
    cuts = _cuts(machine)
    cuts = cuts[np.concatenate([[True], np.diff(cuts) > 1e-12])]
    end = TURN * machine.cycle

    def resisting(phi: Array) -> Array:
        return np.asarray(sum(resistance(part, phi, machine) for part in machine.parts))

    def whole(phi: Array) -> Array:
        return np.asarray(machine.inertia + sum(inertia(part, phi) for part in machine.parts))

    def work(low: Array, high: Array) -> Array:
        half = 0.5 * (high - low)
        nodes = (low + half)[..., None] + half[..., None] * _NODES
        return np.asarray((half[..., None] * _WEIGHTS * (resisting(nodes) + drive)).sum(axis=-1))

    drive = 0.0
    pieces = work(cuts[:-1], cuts[1:])
    against = float(pieces.sum())
    drive = -against / end
    pieces = work(cuts[:-1], cuts[1:])
    sums = np.concatenate([[0.0], np.cumsum(pieces)])

    # Samples in every piece: the work to them, and the inertia there.
    shares = np.linspace(0.0, 1.0, 13)[:-1]
    low, width = cuts[:-1, None], np.diff(cuts)[:, None]
    angles = low + width * shares
    works = sums[:-1, None] + work(np.broadcast_to(low, angles.shape), angles)
    inertias = whole(angles)

    def at(k: int, phi: float) -> tuple[float, float]:
        own = sums[k] + float(work(np.array(cuts[k]), np.array(phi)))
        return own, float(whole(np.array([phi]))[0])

    def extreme(sign: float, score: Callable[[Any, Any], Any]) -> float:
        """Largest value of ``sign`` times a function of work and inertia."""
        sampled = sign * np.ravel(score(works, inertias))
        found, last = float(sampled.max()), len(sampled) - 1
        # Samples beside a maximum are lower by the square of their distance: the largest may be beside another.
        tops = (sampled >= np.roll(sampled, 1)) & (sampled >= np.roll(sampled, -1))
        tops &= sampled >= found - _NEAR * np.ptp(sampled)
        edges = np.concatenate([np.ravel(angles), [end]])
        for left in {(flat - side) % (last + 1) for flat in np.nonzero(tops)[0] for side in (0, 1)}:
            bounds = float(edges[left]), float(edges[left + 1])
            k = int(np.clip(np.searchsorted(cuts, 0.5 * (bounds[0] + bounds[1])) - 1, 0, len(cuts) - 2))
            if bounds[1] > bounds[0]:
                best = minimize_scalar(lambda p, k=k: -sign * score(*at(k, p)), bounds=bounds, method="bounded",
                                       options={"xatol": 1e-11})  # fmt: skip
                found = max(found, -float(best.fun))
        return sign * found

    def speeds(start: float) -> tuple[float, float]:
        return tuple(math.sqrt(extreme(sign, lambda w, i: 2.0 * (start + w) / i)) for sign in (1.0, -1.0))  # type: ignore[return-value]

    least = -float(works.min())
    guess = 0.5 * machine.speed**2 * float(inertias.mean())
    start = brentq(lambda t: sum(speeds(t)) - 2.0 * machine.speed, least + 1e-3 * guess, least + 4.0 * guess,
                   xtol=1e-12 * guess, rtol=1e-14)  # fmt: skip
    fastest, slowest = speeds(start)
    return {
        "omega.max": fastest,
        "omega.min": slowest,
        "irregularity": 2.0 * (fastest - slowest) / (fastest + slowest),
        "drive_torque.mean": drive,
        "work.resistance": against,
        "energy.fluctuation": extreme(1.0, lambda w, _: w) - extreme(-1.0, lambda w, _: w),
        "inertia.max": extreme(1.0, lambda _, i: i),
        "inertia.min": extreme(-1.0, lambda _, i: i),
    }
