"""Planar linkages computed in another way: angles by the law of cosines, velocities by complex steps; and random ones.

Nothing of the engine's kinematics is used.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.machine_shaft.elements import LinkageChoice
from tests.engine.machine_shaft.linkages import Numbers, linkage, pivot, point, rpr, rrp, rrr

Array = NDArray[Any]
#: Mass, inertia, and the centre's x and y and the body's angle.
Body = tuple[float, float, Array, Array, Array]
_STEP = 1e-30
_EIGHTH = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}


def _angle(y: Array, x: Array) -> Array:
    """arctan2 of complex numbers near the real axis."""
    turned = np.arctan2(y.real, x.real)
    cos, sin = np.cos(turned), np.sin(turned)
    return turned + np.arctan((y * cos - x * sin) / (x * cos + y * sin))


def positions(choice: LinkageChoice, v: Numbers, phi: Array) -> tuple[dict[str, tuple[Array, Array]], list[Body]]:
    """Joints by their names, and the bodies, at angles that may be complex."""
    joints = {"O": (0.0 * phi, 0.0 * phi), "A": (v["crank"] * np.cos(phi), v["crank"] * np.sin(phi))}
    #: Of each link, the place from which its points count, and its angle.
    links = {"frame": (joints["O"], 0.0 * phi), "crank": (joints["O"], phi)}
    bodies: list[Body] = []

    def at(link: str, along: float, across: float) -> tuple[Array, Array]:
        (x, y), turned = links[link]
        cos, sin = np.cos(turned), np.sin(turned)
        return x + along * cos - across * sin, y + along * sin + across * cos

    for index, each in enumerate(choice.elements):
        own = {name.rpartition(".")[2]: value for name, value in v.items() if name.startswith(f"elements.{index}.")}
        name, sign = each.name, each.sign
        if each.kind == "pivot":
            joints[name] = own["x"] + 0.0 * phi, own["y"] + 0.0 * phi
        elif each.kind == "point":
            joints[name] = at(each.guides[0], own["along"], own["across"])
            bodies.append((own["mass"], 0.0, *joints[name], links[each.guides[0]][1]))
        elif each.kind == "RRR":
            (x, y), (x2, y2) = (joints[joint] for joint in each.joints)
            a, b, square = own["first"], own["second"], (x2 - x) ** 2 + (y2 - y) ** 2
            turned = _angle(y2 - y, x2 - x) + sign * np.arccos((a**2 + square - b**2) / (2.0 * a * np.sqrt(square)))
            joints[name] = x + a * np.cos(turned), y + a * np.sin(turned)
            links[f"{name}.first"] = (x, y), turned
            links[f"{name}.second"] = (x2, y2), _angle(joints[name][1] - y2, joints[name][0] - x2)
        elif each.kind == "RRP":
            x, y = joints[each.joints[0]]
            qx, qy = joints[each.joints[1]]
            line = links[each.guides[0]][1] + own["angle"]
            cos, sin = np.cos(line), np.sin(line)
            beside = (y - qy) * cos - (x - qx) * sin - own["offset"]
            inner = np.arcsin(beside / own["first"])
            turned = line - inner if sign > 0.0 else line + np.pi + inner
            joints[name] = x + own["first"] * np.cos(turned), y + own["first"] * np.sin(turned)
            links[f"{name}.first"] = (x, y), turned
            links[f"{name}.slider"] = joints[name], line
            bodies.append((own["mass"], own["inertia"], *joints[name], line))
        else:
            (x, y), (x2, y2) = (joints[joint] for joint in each.joints)
            away = np.sqrt((x - x2) ** 2 + (y - y2) ** 2)
            turned = _angle(y - y2, x - x2)
            inner = np.arcsin(own["offset"] / away)
            links[f"{name}.second"] = (x2, y2), turned - inner if sign > 0.0 else turned + np.pi + inner
            bodies.append((own["block_mass"], 0.0, x, y, turned))
        for end in ("first", "second"):
            if f"{end}_mass" in own:
                link = f"{name}.{end}"
                centre = at(link, own[f"{end}_centre"], own[f"{end}_across"])
                bodies.append((own[f"{end}_mass"], own[f"{end}_inertia"], *centre, links[link][1]))
    return joints, bodies


def by_complex_step(function: Callable[[Array], Array], phi: Array) -> Array:
    """The derivative of a function of real values at real angles."""
    return np.asarray(np.imag(function(phi + 1j * _STEP)) / _STEP)


def slope(function: Callable[[Array], Array], phi: Array, step: float = 2e-3) -> Array:
    """Derivative by central differences of the eighth order."""
    total = sum(c * (function(phi + k * step) - function(phi - k * step)) for k, c in _EIGHTH.items())
    return np.asarray(total / step)


def inertia(choice: LinkageChoice, v: Numbers, phi: Array) -> Array:
    """Reduced inertia."""
    total = np.zeros(len(phi))
    for mass, own, *motion in positions(choice, v, phi + 1j * _STEP)[1]:
        x1, y1, turn1 = (np.imag(part) / _STEP for part in motion)
        total += mass * (x1**2 + y1**2) + own * turn1**2
    return total


def random_chain(rng: np.random.Generator, groups: int) -> tuple[LinkageChoice, Numbers]:
    """A chain of dyads of three kinds on a crank-rocker; links meet with room to spare where the groups before do."""

    def some(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    crank = some(0.03, 0.06)

    def body(end: str) -> Numbers:
        return {f"{end}_centre": some(-0.1, 0.2), f"{end}_across": some(-0.1, 0.1), f"{end}_mass": some(0.0, 5.0),
                f"{end}_inertia": some(0.0, 0.05)}  # fmt: skip

    elements = [pivot("B0", 4.0 * crank, some(-0.3, 0.3) * crank)]
    own = {"first": 4.2 * crank, "second": some(2.2, 2.8) * crank, **body("first"), **body("second")}
    elements.append(rrr("C0", "A", "B0", str(rng.choice(["left", "right"])), **own))
    elements.append(point("D0", "C0.first", some(0.1, 0.2), some(-0.1, 0.1), some(0.0, 3.0)))
    for k in range(1, groups + 1):
        start, kind = f"D{k - 1}", str(rng.choice(["RRR", "RRP", "RPR"]))
        far, to = some(0.5, 0.8), some(0.0, 2.0 * math.pi)
        elements.append(pivot(f"B{k}", far * math.cos(to), far * math.sin(to)))
        if kind == "RRR":
            own = {"first": some(0.9, 1.1), "second": some(0.9, 1.1), **body("first"), **body("second")}
            elements.append(rrr(f"C{k}", start, f"B{k}", str(rng.choice(["left", "right"])), **own))
        elif kind == "RRP":
            own = {"first": some(1.4, 2.0), "angle": to + some(-0.5, 0.5), "offset": some(-0.2, 0.2),
                   "mass": some(0.0, 9.0), "inertia": some(0.0, 0.1), **body("first")}  # fmt: skip
            elements.append(rrp(f"C{k}", start, f"B{k}", branch=str(rng.choice(["ahead", "behind"])), **own))
        else:
            own = {"offset": some(-0.05, 0.05), "block_mass": some(0.0, 2.0), **body("second")}
            elements.append(rpr(f"C{k}", start, f"B{k}", str(rng.choice(["ahead", "behind"])), **own))
        link = f"C{k}.second" if kind == "RPR" else f"C{k}.first"
        elements.append(point(f"D{k}", link, some(0.05, 0.2), some(-0.1, 0.1), some(0.0, 3.0)))
    return linkage(*elements, crank=crank, inclination=some(-3.0, 3.0))
