"""Drawings of machines: lengths to scale among themselves, a place for each dimension, pictures that stand alone."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from functools import cache
from itertools import combinations, pairwise
from xml.etree import ElementTree

import pytest

from sprag_study.service.figures.drawing import Drawing, svg, with_leaders
from sprag_study.service.figures.drawings import drawings
from sprag_study.service.http.views import preset_of
from sprag_study.service.presets import preset_names
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker.study import Study

#: Place and radius of a wheel.
_CIRCLE = r'<circle class="wheel"[^>]*? cx="([\d.]+)" cy="([\d.]+)" r="([\d.]+)"'


@cache
def _study(name: str) -> Study:
    return parse_spec(preset_of(name)["spec"]).study


@cache
def _every_drawing() -> tuple[Drawing, ...]:
    """The drawings of all presets."""
    return tuple(drawing for name in preset_names() for drawing in drawings(_study(name)))


def _lengths(study: Study) -> list[float]:
    """Lengths in px of the dimension lines of a drive's pendulum."""
    (drawing,) = drawings(study)
    return [abs(float(end) - float(begin)) for begin, end in re.findall(r"M[\d.]+ ([\d.]+)V([\d.]+)\"", drawing.shapes)]


@pytest.mark.parametrize(("arm", "spring_arm"), [(0.03, 0.05), (-0.04, 0.02), (0.05, -0.01)])
def test_the_arms_of_a_drive_are_to_scale(arm: float, spring_arm: float) -> None:
    study = _study("one_pendulum")
    base = study.base | {"pendulums.0.arm": arm, "pendulums.0.spring_arm": spring_arm}
    _rod, own, spring = _lengths(replace(study, base=base))
    assert own / spring == pytest.approx(abs(arm / spring_arm), rel=2e-2)


@pytest.mark.parametrize("name", preset_names())
def test_every_machine_is_drawn_with_its_dimensions(name: str) -> None:
    study = _study(name)
    for drawing in drawings(study):
        assert drawing.dimensions
        labels = {each.path: f"{study.base[each.path]:g} <unit>" for each in drawing.dimensions}
        for text in (svg(drawing, alone=True), svg(drawing, labels, alone=True)):
            ElementTree.fromstring(text)
        assert svg(drawing, labels).count("&lt;unit&gt;") == len(labels)
        assert len(re.findall("L", with_leaders(drawing, 76.0, 20.0, 30.0))) >= len(labels)


def test_the_train_has_a_wheel_for_each_shaft_of_its_stages() -> None:
    train, mechanism = drawings(_study("punching_press"))
    assert train.shapes.count('class="wheel"') == 4
    assert {each.path for each in train.dimensions} >= {"drive.stages.0.ratio", "drive.flywheel.mass"}
    assert "mechanism.slider_crank.crank" in {each.path for each in mechanism.dimensions}


def test_a_flywheel_is_drawn_on_its_shaft() -> None:
    study = _study("punching_press")
    assert study.structure is not None
    places = []
    for shaft in (0, 1, None):
        drive = study.structure["drive"] | ({} if shaft is None else {"flywheel_shaft": shaft})
        train = drawings(replace(study, structure=study.structure | {"drive": drive}))[0]
        wheels = [float(x) for x in re.findall(r'class="wheel" cx="([\d.]+)"', train.shapes)]
        (place,) = (float(x) + 6.0 for x in re.findall(r'class="mass" x="([\d.]+)" y="22"', train.shapes))
        places.append(sum(x < place for x in wheels))
        assert all(0.0 < each.x < train.width for each in train.dimensions)
    assert places == [0, 2, 4]


def test_the_drawing_of_a_geared_part_turns_with_its_shaft() -> None:
    study = _study("two_cylinder_compressor")
    assert study.structure is not None
    first, second = study.structure["parts"]
    usual = drawings(study)[-1]
    geared = drawings(replace(study, structure=study.structure | {"parts": [first, second | {"turns": 3}]}))[-1]
    assert geared.title == f"{usual.title} (i = 3)"
    frames, own = json.loads(usual.frames), json.loads(geared.frames)
    assert (frames.get("ratio"), own["ratio"]) == (None, 3.0)
    assert own["joints"] == frames["joints"]  # of a turn of its shaft


def _guides(drawing: Drawing) -> list[str]:
    """The points of each guide."""
    return re.findall(r'class="dashed" points="([^"]*)"', drawing.shapes)


def test_letters_of_a_mechanism_are_beside_its_bars() -> None:
    mechanisms = [drawing for drawing in _every_drawing() if drawing.frames]
    assert len(mechanisms) > 10
    for drawing in mechanisms:
        assert drawing.dimensions
        for each in drawing.dimensions:
            assert each.apart is not None, each
            assert math.hypot(*each.apart) > 10.0, each


def test_lines_of_a_train_end_at_the_top_of_a_wheel() -> None:
    train, _mechanism = drawings(_study("punching_press"))
    tops = {(float(x), float(y) - float(r)) for x, y, r in re.findall(_CIRCLE, train.shapes)}
    stages = [each for each in train.dimensions if each.path.startswith("drive.stages.")]
    assert len(stages) == 2
    assert {(each.x, each.y) for each in stages} <= tops


def test_the_line_of_an_inclination_ends_at_a_guide() -> None:
    guided = [(drawing, " ".join(guides).split()) for drawing in _every_drawing() if (guides := _guides(drawing))]
    assert len(guided) > 5
    for drawing, guides in guided:
        (inclination,) = (each for each in drawing.dimensions if each.path.endswith(".inclination"))
        assert inclination.on or ".cam." in inclination.path or f"{inclination.x:g},{inclination.y:g}" in guides


def test_letters_of_a_drive_lie_neither_on_its_wheel_nor_on_each_other() -> None:
    (drawing,) = drawings(_study("one_pendulum"))
    places = {each.path: (each.x + each.apart[0], each.y + each.apart[1]) for each in drawing.dimensions if each.apart}
    x, y, radius = next(tuple(map(float, own)) for own in re.findall(_CIRCLE, drawing.shapes))
    beside = {"pendulums.0.backlash", "shaft.inertia", "shaft.load"}
    assert beside <= set(places)
    assert all(math.dist(places[path], (x, y)) > radius + 4.0 for path in beside)
    assert all(math.dist(places[one], places[other]) > 18.0 for one in beside for other in beside - {one})
    spring = next(each for each in drawing.dimensions if each.path == "pendulums.0.spring_rate")
    assert re.search(rf'translate\([\d.]+ {spring.y:g}\)"><path class="body" data-spring', drawing.shapes)


def test_ends_of_lines_know_what_they_move_with() -> None:
    _train, mechanism = drawings(_study("punching_press"))
    crank = next(each for each in mechanism.dimensions if each.path.endswith(".crank"))
    joints = json.loads(mechanism.frames)["joints"]
    first, last, share, below = crank.on.split()
    assert {first, last} <= set(joints)
    assert (float(share), float(below)) == (0.5, 0.0)
    assert f'class="leader" data-on="{crank.on}"' in svg(mechanism, {crank.path: "20 mm"})


@pytest.mark.parametrize("name", preset_names())
def test_labels_beside_a_drawing_do_not_touch(name: str) -> None:
    study = _study(name)
    for drawing in drawings(study):
        text = svg(drawing, {each.path: "1 mm" for each in drawing.dimensions})
        labels = re.findall(r'<text data-mark="[^"]*" x="(-?[\d.]+)" y="([\d.]+)"', text)
        for side in {x for x, _ in labels}:
            rows = sorted(float(y) for x, y in labels if x == side)
            # 10 px of capital letters, 5 px of an index below the line, and room between both.
            assert all(below - above >= 20.0 for above, below in pairwise(rows))


def test_lines_to_labels_of_one_side_do_not_cross() -> None:
    for drawing in _every_drawing():
        text = svg(drawing, {each.path: "1 mm" for each in drawing.dimensions}, alone=True)
        lines = [tuple(map(float, line)) for line in re.findall(r'"leader"[^>]* d="M(\S+) (\S+)L(\S+) (\S+)"', text)]
        assert len(lines) == len(drawing.dimensions)
        for (x, y, to_x, to_y), (x_, y_, to_x_, to_y_) in combinations(lines, 2):
            if x != x_ or to_x in {x, to_x_}:
                continue
            # Heights of both lines where the shorter one ends.
            end = min(to_x, to_x_, key=lambda each: abs(each - x))
            first, second = (
                at + (to - at) * (end - x) / (far - x) for at, to, far in ((y, to_y, to_x), (y_, to_y_, to_x_))
            )
            assert (first - second) * (y - y_) > -1e-9, drawing.title
