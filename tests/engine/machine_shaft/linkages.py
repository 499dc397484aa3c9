"""Planar linkages for tests: mechanisms with dimensions as lists of dyads, and lists by their texts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from sprag_study.engine.machine_shaft.elements import Element, LinkageChoice

Numbers = dict[str, float]


def linkage(
    *elements: tuple[Element, Mapping[str, float]], crank: float, working: str = "", **more: Any
) -> tuple[LinkageChoice, Numbers]:
    """A linkage of elements, and all of its numbers, with the defaults of those that are not given."""
    inclination, backward = more.get("inclination", 0.0), more.get("reversed", False)
    numbers = {"crank": crank, "inclination": inclination}
    for index, (element, own) in enumerate(elements):
        numbers |= {f"elements.{index}.{name}": float(value) for name, value in (defaults(element.kind) | own).items()}
    return LinkageChoice(tuple(element for element, _ in elements), working, backward), numbers


def defaults(kind: str) -> Numbers:
    """The numbers of an element that need not be given."""
    bodies = {
        end: {f"{end}_{what}": 0.0 for what in ("centre", "across", "mass", "inertia")} for end in ("first", "second")
    }
    guide = {"angle": 0.0, "offset": 0.0}
    sliding = {"mass": 0.0, "inertia": 0.0}
    return {
        "pivot": {"x": 0.0, "y": 0.0},
        "point": {"along": 0.0, "across": 0.0, "mass": 0.0},
        "RRR": {**bodies["first"], **bodies["second"]},
        "RRP": {**bodies["first"], **guide, **sliding},
        "RPR": {**bodies["second"], "offset": 0.0, "block_mass": 0.0},
        "RPP": {**guide, **sliding, "slot_angle": math.pi / 2.0, "block_mass": 0.0},
        "PRP": {**guide, "angle_2": 0.0, "offset_2": 0.0, "block_mass": 0.0},
    }[kind]


def pivot(name: str, x: float, y: float = 0.0) -> tuple[Element, Numbers]:
    return Element("pivot", name), {"x": x, "y": y}


def point(name: str, link: str, along: float, across: float = 0.0, mass: float = 0.0) -> tuple[Element, Numbers]:
    return Element("point", name, (), (link,)), {"along": along, "across": across, "mass": mass}


def rrr(name: str, start: str, end: str, branch: Any = "left", **numbers: float) -> tuple[Element, Numbers]:
    return Element("RRR", name, (start, end), (), branch), numbers


def rrp(
    name: str, start: str, through: str = "O", guide: str = "frame", branch: Any = "ahead", **numbers: float
) -> tuple[Element, Numbers]:
    return Element("RRP", name, (start, through), (guide,), branch), numbers


def rpr(name: str, start: str, end: str, branch: Any = "ahead", **numbers: float) -> tuple[Element, Numbers]:
    return Element("RPR", name, (start, end), (), branch), numbers


def _rod(v: Mapping[str, float]) -> Numbers:
    return {
        "first": v["rod"], "first_centre": v["rod_centre"], "first_mass": v["rod_mass"],
        "first_inertia": v["rod_inertia"], "mass": v["ram_mass"],
    }  # fmt: skip


def _coupler(v: Mapping[str, float]) -> Numbers:
    return {
        "first": v["coupler"], "first_centre": v["coupler_centre"], "first_mass": v["coupler_mass"],
        "first_inertia": v["coupler_inertia"],
    }  # fmt: skip


def as_dyads(kind: str, v: Mapping[str, float]) -> tuple[LinkageChoice, Numbers]:
    """A mechanism with dimensions as a list of dyads, with the same zero of the angle and the same forward stroke."""
    crank, beta = v["crank"], v.get("inclination", 0.0)
    backward = {"reversed": True, "inclination": -beta}
    if kind == "slider_crank":
        return linkage(rrp("C", "A", offset=v["offset"], **_rod(v)), crank=crank, working="C", **backward)
    if kind == "scotch_yoke":
        yoke = Element("RPP", "Y", ("A", "O"), ("frame",)), {"mass": v["yoke_mass"], "block_mass": v["block_mass"]}
        return linkage(yoke, crank=crank, working="Y", **backward)
    if kind in {"whitworth", "crank_shaper"}:
        return linkage(
            pivot("B", 0.0, -v["pivot_distance"]),
            rpr("L", "A", "B", second_inertia=v["link_inertia"], block_mass=v["block_mass"]),
            point("D", "L.second", v["link_arm"]),
            rrp("C", "D", "B", offset=v["offset"], **_rod(v)),
            crank=crank, working="C", **backward,
        )  # fmt: skip
    if kind == "four_bar":
        return linkage(
            pivot("B", v["frame"]),
            rrr("C", "A", "B", **_coupler(v), second=v["rocker"], second_inertia=v["rocker_inertia"]),
            point("T", "C.second", v["rocker"], mass=v["tray_mass"]),
            crank=crank, working="C", reversed=True, inclination=beta,
        )  # fmt: skip
    if kind == "drag_link":
        at = v["frame_angle"]
        return linkage(
            pivot("B", v["frame"] * math.cos(at), v["frame"] * math.sin(at)),
            rrr("C", "A", "B", **_coupler(v), second=v["follower"], second_inertia=v["follower_inertia"]),
            point("D", "C.second", v["arm"] * math.cos(v["arm_angle"]), v["arm"] * math.sin(v["arm_angle"])),
            rrp("R", "D", "B", offset=v["offset"], **_rod(v)),
            crank=crank, working="R", **backward,
        )  # fmt: skip
    return linkage(
        pivot("B", v["frame"]),
        rrr("C", "A", "B", **_coupler(v), second=v["rocker"], second_inertia=v["rocker_inertia"]),
        rrp("R", "C", "B", angle=v["line_angle"], **_rod(v)),
        crank=crank, working="R", inclination=beta - v["line_angle"],
    )  # fmt: skip
