"""The curve that is shown first for a study."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sprag_study.service.results.curve_cases import select
from sprag_study.service.results.defaults import caption, drawn_numbers, main_query
from sprag_study.service.spec.document import parse_spec

if TYPE_CHECKING:
    from sprag_study.service.results.curves import CurveQuery


def query_of(spec: dict[str, Any], **changes: Any) -> CurveQuery | None:
    """The main curve of a changed spec, which can be selected."""
    study = parse_spec({**spec, **changes}).study
    query = main_query(study)
    if query is not None:
        assert select(study, query).lines
    return query


def axis(path: str, count: int) -> dict[str, Any]:
    return {"path": path, "linspace": [0.1, 0.5, count]}


def test_speed_against_load_with_a_curve_for_each_frequency(spec: dict[str, Any]) -> None:
    query = query_of(spec)
    assert query is not None
    assert (query.x, query.y, query.by) == ("shaft.load", ("shaft.speed.mean",), ("excitation.frequency",))


def test_one_axis_is_drawn_with_mean_and_maximum(spec: dict[str, Any]) -> None:
    query = query_of(spec, axes=[axis("pendulums.0.mass", 3)])
    assert query is not None
    assert (query.x, query.y, query.by) == ("pendulums.0.mass", ("shaft.speed.mean", "shaft.speed.max"), ())


def test_further_axes_are_held_in_their_middle(spec: dict[str, Any]) -> None:
    axes = [axis("shaft.load", 5), axis("excitation.frequency", 30), axis("pendulums.0.mass", 3)]
    query = query_of(spec, axes=axes)
    assert query is not None
    assert (query.x, query.by) == ("shaft.load", ("pendulums.0.mass",))
    ((path, value),) = query.at
    assert path == "excitation.frequency"
    assert 0.28 < float(value) < 0.32
    many = query_of(spec, axes=[axis("shaft.load", 5), axis("excitation.frequency", 30)])
    assert many is not None
    assert (many.by, {path for path, _ in many.of}) == (("excitation.frequency",), {"excitation.frequency"})
    drawn = [float(value) for _, value in many.of]
    assert (len(drawn), drawn[0], drawn[-1]) == (6, 0.1, 0.5)
    assert drawn == sorted(set(drawn))
    assert max(abs(value - (0.1 + 0.08 * place)) for place, value in enumerate(drawn)) < 0.04


def test_some_of_many_values_always_include_that_of_the_base(spec: dict[str, Any]) -> None:
    axes = [{"path": "excitation.frequency", "linspace": ["20 Hz", "35 Hz", 61]}, axis("shaft.load", 5)]
    query = query_of(spec, axes=axes)
    assert query is not None
    assert ("excitation.frequency", "25.0") in query.of
    study = parse_spec({**spec, "axes": axes}).study
    lines = select(study, query).lines
    assert [repr(line.by["excitation.frequency"]) for line in lines] == [value for _, value in query.of]
    assert drawn_numbers(study, query) == 6 * 5


def test_a_further_axis_is_held_at_the_value_of_the_base(spec: dict[str, Any]) -> None:
    tied = {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": ["1 mm", "2 mm"]}
    axes = [{"path": "excitation.frequency", "linspace": ["20 Hz", "35 Hz", 16]}, tied, axis("shaft.load", 5)]
    query = query_of(spec, axes=axes)
    assert query is not None
    assert query.at == (("excitation.frequency", "25.0"),)
    study = parse_spec({**spec, "axes": axes}).study
    assert drawn_numbers(study, query) == 10
    assert caption(study, query) == (
        "shaft.speed.mean against shaft.load, "
        "a curve for each excitation.amplitude_x = excitation.amplitude_y; excitation.frequency = 25 Hz"
    )


def test_zipped_axes_distinguish_curves_along_the_load(spec: dict[str, Any]) -> None:
    query = query_of(spec, combine="zip", axes=[axis("excitation.frequency", 4), axis("shaft.load", 4)])
    assert query is not None
    assert (query.x, query.by, query.at) == ("shaft.load", ("excitation.frequency",), ())


def test_nothing_varies(spec: dict[str, Any]) -> None:
    assert query_of(spec, axes=[]) is None
    assert query_of(spec, axes=[{"path": "shaft.load", "values": [1]}]) is None
