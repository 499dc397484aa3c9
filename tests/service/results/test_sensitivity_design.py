"""Sensitivity on cases that are no complete grid: shares only from genuine samples, main effects as means by hand."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from SALib.analyze import rbd_fast
from scipy.stats import qmc

from sprag_study.service.cli.shown import _show_effects
from sprag_study.service.figures.pictures import draw_sensitivity
from sprag_study.service.reading.quantities import Units
from sprag_study.service.reading.reader import CODES, Reading
from sprag_study.service.results.sensitivity import Sensitivity
from sprag_study.service.results.sensitivity_indices import is_sample
from sprag_study.service.views.sensitivity import indices_csv
from tests.service.results.test_sensitivity import API, SPEED, effects, ranges

if TYPE_CHECKING:
    from tests.service.conftest import Service

A, B, C = "excitation.phase", "pendulums.0.initial_angle", "shaft.load"
NONE = (None, None, None, None)
CODE_NAMES = Reading("vibration-drive", names=CODES)


def indices(found: Sensitivity) -> set[tuple[float | None, ...]]:
    return {
        (e.indices.first_order, e.indices.first_order_error, e.indices.total, e.indices.total_error)
        for e in found.effects
    }


def linspace(path: str, low: float, high: float, count: int) -> dict[str, Any]:
    return {"path": path, "linspace": [low, high, count]}


GRID = [linspace(A, 0, 2, 3), linspace(B, 0, 3, 4), linspace(C, 0.0, 1.9, 20)]


def linear(p: dict[str, Any]) -> Any:
    return 10.0 * p[A] + p[B]


def test_a_grid_that_lacks_a_row_has_means_but_no_shares() -> None:
    lacking = {"axes": GRID, "exclude": [{A: {"is": 0}, B: {"is": 0}}]}
    failed = lambda p: np.where((p[A] == 0.0) & (p[B] == 0.0), np.nan, linear(p))  # noqa: E731
    # a = 0 keeps b = 1, 2, 3; b = 0 keeps a = 1, 2.
    a_means, b_means = [2.0, 11.5, 21.5], [15.0, 11.0, 12.0, 13.0]
    for found in (effects(lacking, linear), effects({"axes": GRID}, failed)):
        assert (found.method, found.cases, indices(found)) == ("none", 220, {NONE})
        assert "the cases are neither a complete grid nor a sample: 20 of 240 are missing" in found.notes[-1]
        assert found.effects[0].means.tolist() == pytest.approx(a_means)
        assert found.effects[1].means.tolist() == pytest.approx(b_means)
        assert found.effects[2].means.tolist() == pytest.approx([np.mean([2.0] * 3 + [11.5] * 4 + [21.5] * 4)] * 20)


def test_an_axis_that_changes_nothing_has_no_share_of_a_grid_that_lacks_a_case() -> None:
    axes = [{"path": A, "values": [0, 1]}, linspace(C, 0.0, 4.9, 50)]
    found = effects({"axes": axes, "exclude": [{A: {"is": 1}, C: {"is": 0}}]}, lambda p: p[A])
    assert (found.method, found.cases, indices(found)) == ("none", 99, {NONE})
    # Groups of five values: 4 of the 9 cases in the first have a = 1, half of those in every other.
    assert found.effects[1].means.tolist() == pytest.approx([4 / 9] + [0.5] * 9)
    # 55 values in groups of 6 and 5: a value's two cases stay together.
    whole = effects({"axes": [axes[0], linspace(C, 0.0, 5.4, 55)]}, lambda p: p[A])
    assert whole.effects[1].means.tolist() == pytest.approx([0.5] * 10)
    assert [effect.indices.first_order for effect in whole.effects] == pytest.approx([1.0, 0.0])


def test_what_is_left_of_a_grid_may_be_a_grid() -> None:
    axes = [linspace(A, 0, 3, 4), linspace(B, 0, 4, 5)]
    found = effects({"axes": axes, "exclude": [{A: {"is": 3}}]}, linear)
    # Values 0..2 and 0..4: variances 100 * 2/3 and 2.
    assert found.method == "grid"
    assert [effect.indices.first_order for effect in found.effects] == pytest.approx([200 / 206, 6 / 206])
    assert [effect.indices.total for effect in found.effects] == pytest.approx([200 / 206, 6 / 206])
    shuffled = "excitation.phase,pendulums.0.initial_angle\n2,0\n0,1\n0,0\n1,1\n2,1\n1,0\n"
    points = effects({"axes": [{"points": shuffled}]}, linear)
    assert (points.method, [effect.indices.first_order for effect in points.effects]) == (
        "grid",
        pytest.approx([800 / 803, 3 / 803]),
    )


def test_zips_unions_and_cancelled_grids_have_no_shares() -> None:
    zipped = effects({"axes": [linspace(A, 0, 1, 100), linspace(B, 0, 3, 100)], "combine": "zip"}, linear)
    assert (zipped.method, indices(zipped)) == ("none", {NONE})
    assert zipped.notes == (f"{A} and {B} were varied together: the cases cannot separate their effects",)
    group = {"combine": "zip", "axes": [linspace(A, 0, 1, 10), linspace(B, 3, 0, 10)]}
    assert "were varied together" in effects({"axes": [group, linspace(C, 0, 1, 9)]}, linear).notes[-1]
    union = effects({"axes": [linspace(A, 0, 1, 60), linspace(B, 0, 3, 60)], "combine": "union"}, linear)
    assert (union.method, indices(union)) == ("none", {NONE})
    assert "neither a complete grid nor a sample" in union.notes[-1]
    # Of 240 cases the first 100 were computed: a = 0 whole, of a = 1 one row of b.
    cancelled = effects({"axes": GRID}, lambda p: np.where(np.arange(240) < 100, linear(p), np.nan))
    assert (cancelled.method, cancelled.missing, indices(cancelled)) == ("none", 140, {NONE})
    assert "140 of 240 are missing" in cancelled.notes[-1]
    assert cancelled.effects[0].means[:2].tolist() == pytest.approx([1.5, 10.0])
    assert np.isnan(cancelled.effects[0].means[2])


def test_samples_give_what_they_gave() -> None:
    for method, count in (("latin_hypercube", 100), ("latin_hypercube", 2000), ("sobol", 512)):
        sample = {"sample": method, "count": count, "seed": 3, "ranges": ranges(-1, 1)}
        inputs: dict[str, Any] = {}

        def function(p: dict[str, Any], inputs: dict[str, Any] = inputs) -> Any:
            inputs.update(p)
            return 2.0 * p[A] + p[B]

        found = effects({"axes": [sample]}, function)
        x = np.stack([inputs[effect.paths[0]] for effect in found.effects], axis=1)
        problem = {"num_vars": 3, "names": list("abc"), "bounds": [[-1, 1]] * 3}
        direct = rbd_fast.analyze(problem, x, 2.0 * x[:, 0] + x[:, 1], M=min(10, (count - 1) // 10), seed=1)
        assert found.method == "rbd-fast"
        assert [effect.indices.first_order for effect in found.effects] == direct["S1"]
        assert [effect.indices.first_order for effect in found.effects] == pytest.approx([0.8, 0.2, 0.0], abs=0.15)


def test_a_sample_that_failed_cases_make_lopsided_is_none() -> None:
    sample = {"axes": [{"sample": "latin_hypercube", "count": 1000, "seed": 3, "ranges": ranges(0, 1)}]}
    fair = effects(sample, lambda p: np.where(p[A] > 0.8, np.nan, 2.0 * p[A] + p[B]))
    # Variances 4 * 0.8^2 / 12 and 1 / 12.
    assert fair.method == "rbd-fast"
    assert [effect.indices.first_order for effect in fair.effects] == pytest.approx(
        [2.56 / 3.56, 1 / 3.56, 0.0], abs=0.06
    )
    corner = effects(sample, lambda p: np.where(p[A] + p[B] > 1.2, np.nan, p[A]))
    assert (corner.method, indices(corner)) == ("none", {NONE})
    assert "neither a complete grid nor a sample: their axes are not independent of each other" in corner.notes[-1]


def test_chance_alone_makes_no_sample_lopsided() -> None:
    for cases, axes in ((100, 3), (200, 10), (1000, 10)):
        assert all(is_sample(qmc.LatinHypercube(axes, rng=seed).random(cases)) for seed in range(40))
    assert all(is_sample(qmc.Sobol(3, rng=seed).random(128)) for seed in range(40))
    drawn = np.random.default_rng(1).normal(size=(1000, 2))
    assert is_sample(drawn)
    drawn[:, 1] += 0.3 * drawn[:, 0]
    assert not is_sample(drawn)


@pytest.mark.parametrize(
    "axes",
    [
        [{"sample": "latin_hypercube", "count": 100, "ranges": ranges(0, 1)[:2]}, {"path": C, "values": [0, 0.1, 0.3]}],
        # b is the distance of a from its middle: no correlation, and all the same one tells the other.
        [{"points": f"{A},{B}\n" + "".join(f"{a / 100},{abs(a - 50.25) / 100}\n" for a in range(101))}],
    ],
)
def test_cases_with_ties_or_ties_between_axes_are_no_sample(axes: list[Any]) -> None:
    found = effects({"axes": axes}, lambda p: p[A])
    assert (found.method, indices(found)) == ("none", {NONE})


def test_nothing_known_is_told_in_a_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    sample = {"sample": "saltelli", "count": 64, "ranges": ranges(-1, 1)}
    for axes in ([linspace(A, 0, 1, 50)], GRID, [sample], [{**sample, "sample": "latin_hypercube"}]):
        found = effects({"axes": axes}, lambda _: np.nan)
        assert (found.method, found.cases, found.mean, indices(found)) == ("none", 0, None, {NONE})
        assert found.notes == ("no case has this result",)
        svg = draw_sensitivity([found], "Title", CODE_NAMES, "svg").decode()
        assert svg.count(">no case has this result</text>") == 2  # the panel and the head; no panel without shares
        below = draw_sensitivity([found], "Title", CODE_NAMES, "svg", noted=False).decode()
        assert below.count(">no case has this result</text>") == 1
        assert all(draw_sensitivity([found], "Title", CODE_NAMES, form) for form in ("png", "pdf"))
    _show_effects(found.to_json())
    assert "note: no case has this result" in capsys.readouterr().err


def test_the_note_is_in_every_form(service: Service, spec: dict[str, Any]) -> None:
    study_id = service.submit({**spec, "axes": [linspace(C, 0, 0.3, 30), linspace(A, 0, 1, 3)]})
    assert service.http.post(f"{API}/studies/{study_id}:cancel").is_success
    place = f"{API}/studies/{study_id}/sensitivity?y={SPEED}"
    (found,) = service.http.get(place).json()["results"]
    assert (found["method"], found["cases"], found["notes"]) == ("none", 0, ["no case has this result"])
    rows = list(csv.DictReader(io.StringIO(service.http.get(f"{place}&format=csv").text)))
    assert [row["notes"] for row in rows] == ["no case has this result"] * 2
    for form in ("svg", "png", "pdf"):
        assert service.http.get(f"{place}&format={form}").status_code == 200


def test_files_are_in_the_units_and_names_of_the_reader(service: Service, spec: dict[str, Any]) -> None:
    sample = {"sample": "morris", "count": 4, "ranges": ranges(0, 1)}
    found = effects({"axes": [sample]}, lambda p: 2.0 * p[A] + p[B] ** 2)
    readings = (Reading("vibration-drive", Units(chosen)) for chosen in ({}, {"rad/s": "rpm"}))
    si, rpm = (list(csv.DictReader(io.StringIO(indices_csv([found], one).decode()))) for one in readings)
    assert ({row["unit"] for row in si}, {row["unit"] for row in rpm}) == ({"rad/s"}, {"rpm"})
    for name in ("mu", "mu_star", "sigma"):
        expected = [float(row[name]) * 30.0 / np.pi for row in si]
        assert [float(row[name]) for row in rpm] == pytest.approx(expected, rel=1e-12)
    study_id = service.submit({**spec, "axes": [linspace(A, 0, 1, 3)]})
    service.fill(study_id)
    place = f"{API}/studies/{study_id}/sensitivity?y={SPEED}"
    svg = service.http.get(f"{place}&format=svg&units=rpm").text
    assert "mean shaft speed" in svg
    assert "(rpm)" in svg
    assert SPEED in service.http.get(f"{place}&format=svg&names=codes").text
    page = service.http.get(f"/studies/{study_id}/matters?y={SPEED}&units=rpm").text
    assert f"sensitivity?y={SPEED}&amp;units=rpm&amp;format=csv" in page
