"""Where the links of each mechanism are at angles of the shaft, as sketches.

Sizes that a mechanism does not have, such as those of its ram or the base circle of its cam, are chosen for the eye.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.elements import (
    FRAME,
    PIN,
    SHAFT,
    Element,
    LinkageChoice,
    fixed_joints,
    link_pivots,
)
from sprag_study.engine.machine_shaft.four_bars import Links
from sprag_study.engine.machine_shaft.machine import Machine
from sprag_study.engine.machine_shaft.mechanisms import Mechanism
from sprag_study.engine.machine_shaft.parts import ShaftPart
from sprag_study.engine.machine_shaft.planar import PlanarLinkage
from sprag_study.engine.machine_shaft.sketch import Bar, Plate, Sketch
from sprag_study.engine.machine_shaft.sliders import Slider
from sprag_study.engine.machine_shaft.spec import MachineSpec

Floats = NDArray[np.float64]

_OUTLINE = 181
_ROD = ("rod", "rod_mass", "rod_inertia", "rod_centre")
_COUPLER = ("coupler", "coupler_mass", "coupler_inertia", "coupler_centre")

_Numbers = Mapping[str, float]


def _point(x: Floats | float, y: Floats | float, like: Floats) -> Floats:
    return np.column_stack([np.broadcast_to(x, like.shape), np.broadcast_to(y, like.shape)])


def _circular(radius: float, angle: Floats, x: float = 0.0, y: float = 0.0) -> Floats:
    """Points on a circle about (x, y)."""
    return np.column_stack([x + radius * elementary.cos(angle), y + radius * elementary.sin(angle)])


def _rectangle(length: float, height: float, x: float = 0.0) -> Floats:
    """A rectangle about (x, 0)."""
    sides = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * (0.5 * length, 0.5 * height)
    return np.asarray(sides + np.array([x, 0.0]))


def _with_ram(sketch: Sketch, pin: str, ram: Floats, direction: float = 0.0) -> Sketch:
    """Add the rod from ``pin`` to the ram, the ram and its guides along ``direction`` (rad)."""
    sketch.joints["ram"] = ram
    size = 0.09 * float(np.ptp(np.concatenate(list(sketch.joints.values())), axis=0).max())
    sketch.bars.append(Bar((pin, "ram"), _ROD))
    sketch.turns["ram"] = np.full(len(ram), direction)
    sketch.plates.append(Plate("ram", _rectangle(2.2 * size, 1.4 * size), ("ram_mass", "inclination"), "ram"))
    along, across = (
        np.array([elementary.cos(direction), elementary.sin(direction)]),
        np.array([-elementary.sin(direction), elementary.cos(direction)]),
    )
    way = ((ram - ram[0]) * along).sum(axis=1)
    for side in (-0.75, 0.75):
        ends = [ram[0] + along * (way.min() - 1.6 * size), ram[0] + along * (way.max() + 1.6 * size)]
        sketch.guides.append(np.array(ends) + side * size * across)
    return sketch


def _slider_crank(v: _Numbers, phi: Floats, _: Mechanism) -> Sketch:
    slider = _slider(v["crank"], v, phi)
    sketch = Sketch({"O": _point(0.0, 0.0, phi), "pin": _circular(v["crank"], phi)})
    sketch.bars.append(Bar(("O", "pin"), ("crank",)))
    return _with_ram(sketch, "pin", _point(slider.x(), v["offset"], phi)).turned(-v["inclination"])


def _slider(radius: float, v: _Numbers, theta: Floats) -> Slider:
    return Slider(np.asarray(radius), np.asarray(v["rod"]), np.asarray(v.get("offset", 0.0)), theta)


def _scotch_yoke(v: _Numbers, phi: Floats, _: Mechanism) -> Sketch:
    r = v["crank"]
    pin, x = _circular(r, phi), r * elementary.cos(phi)
    sketch = Sketch({"O": _point(0.0, 0.0, phi), "pin": pin, "yoke": _point(x, 0.0, phi)})
    sketch.turns["yoke"] = np.zeros(len(phi))
    slot, arm = _rectangle(0.44 * r, 2.6 * r), _rectangle(1.9 * r, 0.28 * r, 1.17 * r)
    sketch.plates = [Plate("yoke", outline, ("yoke_mass", "inclination"), "yoke") for outline in (slot, arm)]
    sketch.plates.append(Plate("pin", _rectangle(0.36 * r, 0.44 * r), ("block_mass",), "yoke"))
    sketch.bars = [Bar(("O", "pin"), ("crank",))]
    sketch.guides = [np.array([[1.6 * r, side * r], [2.4 * r, side * r]]) for side in (-0.2, 0.2)]
    return sketch.turned(-v["inclination"])


def _links(v: _Numbers, phi: Floats, third: str = "rocker") -> Links:
    return Links.of({name: np.asarray(value) for name, value in v.items()}, phi, third)


def _four_bar(v: _Numbers, phi: Floats, _: Mechanism) -> Sketch:
    links, d = _links(v, phi), v["frame"]
    sketch = Sketch({"O": _point(0.0, 0.0, phi), "pivot": _point(d, 0.0, phi), "pin": _circular(v["crank"], phi)})
    sketch.joints["rocker"] = _circular(v["rocker"], links.psi, d)
    sketch.bars = [Bar(("O", "pin"), ("crank",)), Bar(("pin", "rocker"), _COUPLER)]
    sketch.bars.append(Bar(("rocker", "pivot"), ("rocker", "rocker_inertia")))
    sketch.pivots.append("pivot")
    if v["tray_mass"] > 0.0:
        size = 0.3 * v["rocker"]
        sketch.plates.append(Plate("rocker", _rectangle(3.0 * size, 0.4 * size), ("tray_mass",)))
    return sketch.turned(v.get("inclination", 0.0))


def _parallel_crank(v: _Numbers, phi: Floats, _: Mechanism) -> Sketch:
    r = v["crank"]
    frame = 2.6 * r
    sketch = Sketch({"O": _point(0.0, 0.0, phi), "pivot": _point(frame, 0.0, phi), "pin": _circular(r, phi)})
    sketch.joints["second"] = _circular(r, phi, frame)
    about = ("coupler_mass", "inclination")
    sketch.bars = [Bar(("O", "pin"), ("crank",)), Bar(("pin", "second"), about)]
    sketch.bars.append(Bar(("second", "pivot"), ("driven_inertia",)))
    sketch.pivots.append("pivot")
    return sketch.turned(-v["inclination"])


def _quick_return(v: _Numbers, phi: Floats, _: Mechanism) -> Sketch:
    r, d, arm = v["crank"], v["pivot_distance"], v["link_arm"]
    pin = _circular(r, phi)
    theta, away = elementary.arctan2(d + pin[:, 1], pin[:, 0]), np.sqrt(np.square(pin[:, 0]) + np.square(d + pin[:, 1]))
    sketch = Sketch({"O": _point(0.0, 0.0, phi), "pivot": _point(0.0, -d, phi), "pin": pin})
    sketch.joints["arm"] = _circular(arm, theta, 0.0, -d)
    sketch.joints["end"] = _circular(max(arm, 1.1 * float(away.max())), theta, 0.0, -d)
    sketch.turns["link"] = theta
    sketch.bars = [Bar(("pivot", "end"), ("link_arm", "link_inertia")), Bar(("O", "pin"), ("crank",))]
    sketch.plates = [Plate("pin", _rectangle(0.36 * r, 0.22 * r), ("block_mass",), "link")]
    sketch.pivots.append("pivot")
    ram = _point(_slider(arm, v, theta).x(), v["offset"] - d, phi)
    return _with_ram(sketch, "arm", ram).turned(-v["inclination"])


def _drag_link(v: _Numbers, phi: Floats, _: Mechanism) -> Sketch:
    turned = v["frame_angle"]
    links = _links(v, phi - turned, "follower")
    x, y = (float(v["frame"] * part) for part in (elementary.cos(turned), elementary.sin(turned)))
    arm = links.psi + turned + v["arm_angle"]
    sketch = Sketch({"O": _point(0.0, 0.0, phi), "pivot": _point(x, y, phi), "pin": _circular(v["crank"], phi)})
    sketch.joints["follower"] = _circular(v["follower"], links.psi + turned, x, y)
    sketch.joints["arm"] = _circular(v["arm"], arm, x, y)
    sketch.bars = [Bar(("O", "pin"), ("crank",)), Bar(("pin", "follower"), _COUPLER)]
    sketch.bars.append(Bar(("follower", "pivot"), ("follower", "follower_inertia")))
    sketch.bars.append(Bar(("pivot", "arm"), ("arm", "arm_angle")))
    sketch.pivots.append("pivot")
    ram = _point(x + _slider(v["arm"], v, arm).x(), y + v["offset"], phi)
    return _with_ram(sketch, "arm", ram).turned(-v["inclination"])


def _toggle(v: _Numbers, phi: Floats, _: Mechanism) -> Sketch:
    links, d, line = _links(v, phi), v["frame"], v["line_angle"]
    x = _slider(v["rocker"], v, links.psi - line).x()
    sketch = Sketch({"O": _point(0.0, 0.0, phi), "pivot": _point(d, 0.0, phi), "pin": _circular(v["crank"], phi)})
    sketch.joints["rocker"] = _circular(v["rocker"], links.psi, d)
    sketch.bars = [Bar(("O", "pin"), ("crank",)), Bar(("pin", "rocker"), _COUPLER)]
    sketch.bars.append(Bar(("rocker", "pivot"), ("rocker", "rocker_inertia")))
    sketch.pivots.append("pivot")
    ram = _point(d + x * elementary.cos(line), x * elementary.sin(line), phi)
    return _with_ram(sketch, "rocker", ram, line).turned(v["inclination"] - line)


def _cam(v: _Numbers, phi: Floats, mechanism: Mechanism) -> Sketch:
    base = 1.6 * v["lift"]
    values = {name: np.full((1, 1, 1), value) for name, value in v.items()}

    def lift(angle: Floats) -> Floats:
        return np.asarray(mechanism.motion(values, angle.reshape(1, 1, -1)).way).reshape(-1)

    around = np.linspace(0.0, 2.0 * np.pi, _OUTLINE)
    outline = _circular(1.0, 0.5 * np.pi - around) * (base + lift(around))[:, None]
    tip = base + lift(phi)
    sketch = Sketch({"O": _point(0.0, 0.0, phi), "tip": _point(0.0, tip, phi)})
    sketch.joints["top"] = _point(0.0, tip + 1.5 * base, phi)
    sketch.turns |= {"cam": phi, "follower": np.full(len(phi), 0.0)}
    size = 0.3 * base
    sketch.plates = [Plate("O", outline, ("lift", "start", "rise_angle", "dwell_angle", "fall_angle"), "cam")]
    sketch.plates.append(Plate("top", _rectangle(2.2 * size, size), ("follower_mass", "spring_rate"), "follower"))
    sketch.bars = [Bar(("tip", "top"), ("follower_mass", "inclination"))]
    reach = base + v["lift"]
    sketch.guides = [np.array([[x, reach + 0.2 * base], [x, reach + 0.7 * base]]) for x in (-0.3 * size, 0.3 * size)]
    return sketch.turned(v["inclination"] - 0.5 * np.pi)


def _shaft_alone(_: _Numbers, phi: Floats, __: Mechanism | None) -> Sketch:
    """What has no dimensions: a disc with a mark."""
    sketch = Sketch({"O": _point(0.0, 0.0, phi), "mark": _circular(1.0, phi)}, {"disc": phi})
    sketch.plates = [Plate("O", _circular(1.0, np.linspace(0.0, 2.0 * np.pi, _OUTLINE)), (), "disc")]
    sketch.bars = [Bar(("O", "mark"), ())]
    return sketch.turned(0.0)


def _linkage(v: _Numbers, phi: Floats, mechanism: Mechanism) -> Sketch:
    assert isinstance(mechanism, PlanarLinkage)
    values = {name: np.full((1, 1, 1), value) for name, value in v.items()}
    pose, fixed = mechanism.pose(values, phi[None, None, :]), fixed_joints(mechanism.choice)

    def line(value: Floats) -> Floats:
        return np.asarray(np.broadcast_to(value, (1, 1, len(phi)))[0, 0])

    sketch = Sketch({name: _point(line(place.at.x), line(place.at.y), phi) for name, place in pose.joints.items()})
    sketch.pivots = [name for name in pose.joints if name in fixed]
    size = 0.07 * float(np.nan_to_num(np.ptp(np.concatenate(list(sketch.joints.values())), axis=0)).max())
    sketch.turns = {
        name: elementary.arctan2(line(link.direction.y), line(link.direction.x)) for name, link in pose.links.items()
    }
    sketch.bars.append(Bar((SHAFT, PIN), ("crank",)))
    for index, each in enumerate(mechanism.choice.elements):
        _draw_element(sketch, each, f"elements.{index}", size, mechanism.choice)
    return sketch.turned(v["inclination"])


def _draw_element(sketch: Sketch, each: Element, at: str, size: float, choice: LinkageChoice) -> None:
    name, joints = each.name, each.joints
    if each.kind == "point":
        link = each.guides[0]
        base = link_pivots(choice)[link]
        if link != FRAME and base != name:
            sketch.bars.append(Bar((base, name), (f"{at}.along",)))
        return
    if each.kind in {"RRR", "RRP"}:
        sketch.bars.append(Bar((joints[0], name), (f"{at}.first",)))
    if each.kind == "RRR":
        sketch.bars.append(Bar((name, joints[1]), (f"{at}.second",)))
    block = Plate(joints[0] if joints else "", _rectangle(1.4 * size, 0.8 * size), (f"{at}.block_mass",))
    if each.kind == "RPR":
        pin, bar = sketch.joints[joints[0]], sketch.joints[joints[1]]
        away = np.sqrt(np.square(pin - bar).sum(axis=1))
        reach = max(1.1 * float(np.nan_to_num(away).max()), size)
        sketch.joints[f"{name}.end"] = bar + _circular(each.sign * reach, sketch.turns[f"{name}.second"])
        sketch.bars.append(Bar((joints[1], f"{name}.end"), (f"{at}.offset",)))
        sketch.plates.append(replace(block, turn=f"{name}.second"))
    if each.kind in {"RRP", "RPP"}:
        sliding = (f"{at}.mass", "inclination")
        sketch.plates.append(Plate(name, _rectangle(2.2 * size, 1.4 * size), sliding, f"{name}.slider"))
    if each.kind == "RPP":
        sketch.bars.append(Bar((name, joints[0]), (f"{at}.slot_angle",)))
        sketch.plates.append(block)
    if each.kind == "PRP":
        sketch.plates.append(replace(block, joint=name))
    through = joints if each.kind == "PRP" else joints[1:]
    for joint, link in zip(through, each.guides, strict=False):
        if link == FRAME:
            sketch.guides += _rails(sketch.joints[name], size)
        elif joint != name:
            sketch.bars.append(Bar((joint, name), (f"{at}.angle",)))


def _rails(way: Floats, size: float) -> list[Floats]:
    """Two lines beside the way of what slides on the frame."""
    first, last = way[np.argmin(way[:, 0] + 1e-3 * way[:, 1])], way[np.argmax(way[:, 0] + 1e-3 * way[:, 1])]
    if abs(last[0] - first[0]) < abs(np.ptp(way[:, 1])):
        first, last = way[np.argmin(way[:, 1])], way[np.argmax(way[:, 1])]
    length = float(np.sqrt(np.square(last - first).sum()))
    along = (last - first) / length if length > 0.0 else np.array([1.0, 0.0])
    across = np.array([-along[1], along[0]])
    ends = np.array([first - 1.6 * size * along, last + 1.6 * size * along])
    return [ends + side * size * across for side in (-0.75, 0.75)]


_SKETCHES: Mapping[str, Callable[[_Numbers, Floats, Mechanism], Sketch]] = {
    "slider_crank": _slider_crank,
    "scotch_yoke": _scotch_yoke,
    "four_bar": _four_bar,
    "parallel_crank": _parallel_crank,
    "quick_return": _quick_return,
    "drag_link": _drag_link,
    "toggle": _toggle,
    "cam": _cam,
    "linkage": _linkage,
}


def _sketch_of(part: ShaftPart, angles: Floats) -> Sketch:
    draw = _SKETCHES.get(part.choice.mechanism.kind)
    numbers = {name: float(np.asarray(value).flat[0]) for name, value in part.values.items()}
    if draw is None or part.mechanism is None:
        return _shaft_alone(numbers, angles, None)
    return draw(numbers, angles, part.mechanism)


def sketches(spec: MachineSpec, numbers: Mapping[str, float], angles: Sequence[float] | Floats) -> tuple[Sketch, ...]:
    """Each mechanism of a machine at angles of the shaft.

    Parameters
    ----------
    spec : MachineSpec
    numbers : mapping
        Path -> value in SI units, complete for the structure.
    angles : array, shape (m,)
        In rad. Coordinates are NaN where links do not reach each other.

    Returns
    -------
    tuple of Sketch
        One for each part, or the only one; drawn as it stands, with level ground below.
    """
    machine = Machine(spec, Columns.of(spec, numbers, 1))
    asked = np.asarray(angles, dtype=np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        return tuple(
            _sketch_of(part, part.ratio * asked + float(numbers.get(f"{part.prefix}crank_angle", 0.0)))
            for part in machine.parts
        )
