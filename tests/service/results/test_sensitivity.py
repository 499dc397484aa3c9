"""Sensitivity: indices against functions whose indices are known in closed form; parameters that change nothing."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from SALib.analyze import morris as morris_analyze
from SALib.sample import morris as morris_sample

from sprag_study.service.answers import results
from sprag_study.service.cli.shown import _show_effects
from sprag_study.service.faults import SelectionError
from sprag_study.service.reading.wording import number as number_text
from sprag_study.service.results.curves import Fetch
from sprag_study.service.results.sensitivity import sensitivity
from sprag_study.service.results.unaffected import unaffected
from sprag_study.service.spec.draws.unit import LEVELS
from sprag_study.service.storage.studies.records import CaseColumns
from sprag_study.worker import models
from sprag_study.worker.models import ChunkResult
from sprag_study.worker.study import Study
from tests.service.shapes import fits
from tests.service.spec_sample import parsed

if TYPE_CHECKING:
    from tests.service.conftest import Service

API = "/api/v1"
SPEED = "shaft.speed.mean"
Function = Callable[[dict[str, Any]], Any]


def fetching(study: Study, function: Function) -> Fetch:
    """A store whose every result is that function of the parameters."""

    def fetch(cases: Any, names: Any) -> CaseColumns:
        columns = {**study.base, **study.columns(cases)}
        y = np.broadcast_to(function(columns), len(cases)).astype(np.float64)
        return CaseColumns(cases, ["ok"] * len(cases), dict.fromkeys(names, y))

    return fetch


def effects(spec: dict[str, Any], function: Function) -> Any:
    """Sensitivity of the speed, when it is that function."""
    made = parsed({f"/{key}": value for key, value in spec.items()})
    (found,) = sensitivity(made.study, made.spec, [SPEED], fetching(made.study, function))
    return found


def ranges(low: float, high: float) -> list[dict[str, Any]]:
    paths = ("excitation.phase", "pendulums.0.initial_angle", "pendulums.0.arm")
    return [{"path": path, "from": low, "to": high} for path in paths]


def test_a_full_grid_gives_exact_shares() -> None:
    grid = {
        "axes": [
            {"path": "excitation.phase", "values": [-1, 0, 1]},
            {"path": "pendulums.0.initial_angle", "values": [-2, 2]},
            {"path": "shaft.load", "values": [0.1, 0.2]},
        ]
    }
    # Values are centred: of y = 3 u + v, the variances are 9 * 2/3 and 4; of a product nothing is first order.
    linear = effects(grid, lambda p: 3.0 * p["excitation.phase"] + p["pendulums.0.initial_angle"])
    assert [effect.indices.first_order for effect in linear.effects] == pytest.approx([0.6, 0.4, 0.0], abs=1e-12)
    assert [effect.indices.total for effect in linear.effects] == pytest.approx([0.6, 0.4, 0.0], abs=1e-12)
    assert linear.effects[0].means.tolist() == pytest.approx([-3.0, 0.0, 3.0])
    assert (linear.method, linear.cases, linear.missing) == ("grid", 12, 0)
    assert linear.variance == pytest.approx(10.0)
    product = effects(grid, lambda p: p["excitation.phase"] * p["pendulums.0.initial_angle"])
    assert [effect.indices.first_order for effect in product.effects] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert [effect.indices.total for effect in product.effects] == pytest.approx([1.0, 1.0, 0.0], abs=1e-12)


def ishigami(p: dict[str, Any]) -> Any:
    a, b, c = p["excitation.phase"], p["pendulums.0.initial_angle"], p["pendulums.0.arm"] * np.pi
    return np.sin(a) + 7.0 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a)


def test_the_design_for_indices_gives_those_of_the_ishigami_function() -> None:
    spans = ranges(-np.pi, np.pi)
    spans[2] |= {"from": -1, "to": 1}
    sample = {"sample": "saltelli", "count": 1024, "ranges": spans}
    found = effects({"axes": [sample]}, ishigami)
    assert (found.method, found.cases) == ("saltelli", 1024 * 5)
    # Closed form for a = 7, b = 0.1 (Ishigami and Homma 1990).
    for effect, first, total in zip(found.effects, (0.3139, 0.4424, 0.0), (0.5576, 0.4424, 0.2437), strict=True):
        assert effect.indices.first_order == pytest.approx(first, abs=0.03)
        assert effect.indices.total == pytest.approx(total, abs=0.03)
        assert 0.0 < effect.indices.total_error < 0.1


def test_second_order_indices_of_the_ishigami_function_are_those_of_the_closed_form() -> None:
    spans = ranges(-np.pi, np.pi)
    spans[2] |= {"from": -1, "to": 1}
    sample = {"sample": "saltelli", "count": 1024, "second_order": True, "ranges": spans}
    found = effects({"axes": [sample]}, ishigami)
    assert (found.method, found.cases) == ("saltelli", 1024 * 8)
    # Only the first and the third parameter interact.
    pairs = {(pair.first, pair.second): pair for pair in found.pairs}
    assert list(pairs) == [(0, 1), (0, 2), (1, 2)]
    for at, index in zip(pairs, (0.0, 0.2437, 0.0), strict=True):
        assert pairs[at].index == pytest.approx(index, abs=0.04)
        assert 0.0 < pairs[at].error < 0.12
    for effect, total in zip(found.effects, (0.5576, 0.4424, 0.2437), strict=True):
        assert effect.indices.total == pytest.approx(total, abs=0.03)


def sobol_g(p: dict[str, Any]) -> Any:
    """The g-function of Sobol on -1..1 with a = 0, 1, 4.5."""
    values = (p["excitation.phase"], p["pendulums.0.initial_angle"], p["pendulums.0.arm"])
    parts = [(np.abs(2.0 * value) + a) / (1.0 + a) for value, a in zip(values, (0.0, 1.0, 4.5), strict=True)]
    return np.prod(parts, axis=0)


def test_indices_of_all_orders_are_those_of_the_g_function() -> None:
    sample = {"sample": "saltelli", "count": 2048, "second_order": True, "ranges": ranges(-1, 1)}
    found = effects({"axes": [sample]}, sobol_g)
    # Closed form: partial variances 1/3 / (1 + a)^2 and their products (Saltelli et al. 2010).
    parts = 1.0 / 3.0 / (1.0 + np.array([0.0, 1.0, 4.5])) ** 2
    whole = np.prod(1.0 + parts) - 1.0
    for at, effect in enumerate(found.effects):
        others = np.prod(1.0 + np.delete(parts, at))
        assert effect.indices.first_order == pytest.approx(parts[at] / whole, abs=0.03)
        assert effect.indices.total == pytest.approx(parts[at] * others / whole, abs=0.03)
    for pair in found.pairs:
        assert pair.index == pytest.approx(parts[pair.first] * parts[pair.second] / whole, abs=0.03)


def test_a_full_grid_gives_exact_indices_of_pairs() -> None:
    grid = {
        "axes": [{"path": path, "values": [-1, 0, 1]} for path in ("excitation.phase", "pendulums.0.initial_angle")]
    }
    found = effects(grid, lambda p: p["excitation.phase"] * (1.0 + p["pendulums.0.initial_angle"]))
    # Of u + u v, both of mean 0 and variance 2/3: shares 2/3 and 4/9 of 10/9.
    (pair,) = found.pairs
    assert (pair.index, pair.error) == (pytest.approx(0.4), None)
    assert [effect.indices.first_order for effect in found.effects] == pytest.approx([0.6, 0.0])


def test_trajectories_give_the_elementary_effects_of_salib() -> None:
    sample = {"sample": "morris", "count": 40, "seed": 3, "ranges": ranges(-1, 1)}
    found = effects({"axes": [sample]}, ishigami)
    assert (found.method, found.cases) == ("morris", 160)
    problem = {"num_vars": 3, "names": list("abc"), "bounds": [[-1, 1]] * 3}
    drawn = morris_sample.sample(problem, 80, num_levels=LEVELS, seed=3)[:160]
    names = ("excitation.phase", "pendulums.0.initial_angle", "pendulums.0.arm")
    direct = morris_analyze.analyze(problem, drawn, ishigami(dict(zip(names, drawn.T, strict=True))), num_levels=LEVELS)
    for name in ("mu", "mu_star", "sigma"):
        assert [getattr(effect.indices, name) for effect in found.effects] == pytest.approx(list(direct[name]))
    assert all(0.0 < effect.indices.mu_star_error < effect.indices.mu_star for effect in found.effects)
    linear = effects({"axes": [sample]}, lambda p: 3.0 * p["excitation.phase"] - p["pendulums.0.arm"])
    # Of a linear function each effect is the slope times the range.
    assert [effect.indices.mu for effect in linear.effects] == pytest.approx([6.0, 0.0, -2.0])
    assert [effect.indices.sigma for effect in linear.effects] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert {effect.indices.first_order for effect in linear.effects} == {None}


def test_trajectories_with_a_missing_case_are_left_out_whole() -> None:
    sample = {"sample": "morris", "count": 40, "seed": 3, "ranges": ranges(-1, 1)}
    spec = {"axes": [sample]}
    found = effects(spec, lambda p: np.where(p["excitation.phase"] > 0.95, np.nan, p["pendulums.0.arm"]))
    assert found.missing > 0
    assert [effect.indices.mu for effect in found.effects] == pytest.approx([0.0, 0.0, 2.0])
    assert any("trajectories are left out" in note for note in found.notes)
    none = effects(spec, lambda p: np.where(p["excitation.phase"] > -2.0, np.nan, p["pendulums.0.arm"]))
    assert none.notes == ("no case has this result",)


def test_points_of_the_design_with_a_missing_case_are_left_out_whole() -> None:
    sample = {"sample": "saltelli", "count": 256, "ranges": ranges(-1, 1)}

    def function(p: dict[str, Any]) -> Any:
        return np.where(p["excitation.phase"] > 0.9, np.nan, p["pendulums.0.initial_angle"])

    found = effects({"axes": [sample]}, function)
    assert found.missing > 0
    assert found.effects[1].indices.first_order == pytest.approx(1.0, abs=0.05)
    assert any("points of the design are left out" in note for note in found.notes)


def test_any_sample_gives_first_order_shares() -> None:
    sample = {"sample": "latin_hypercube", "count": 2000, "seed": 5, "ranges": ranges(-1, 1)}
    found = effects({"axes": [sample]}, lambda p: 2.0 * p["excitation.phase"] + p["pendulums.0.initial_angle"])
    assert found.method == "rbd-fast"
    assert [effect.indices.first_order for effect in found.effects] == pytest.approx([0.8, 0.2, 0.0], abs=0.04)
    assert {effect.indices.total for effect in found.effects} == {None}
    line = found.effects[0]
    assert len(line.values) == 10
    np.testing.assert_allclose(line.means, 2.0 * line.values, atol=0.15)


def test_what_cannot_be_told_is_not_told() -> None:
    few = {"sample": "sobol", "count": 16, "ranges": ranges(-1, 1)}
    found = effects({"axes": [few]}, lambda p: p["excitation.phase"])
    assert {effect.indices.first_order for effect in found.effects} == {None}
    constant = effects({"axes": [{**few, "count": 128}]}, lambda _: 5.0)
    assert {effect.indices.first_order for effect in constant.effects} == {None}
    assert "the result is the same in every case" in constant.notes
    with pytest.raises(SelectionError, match="nothing varies"):
        effects({"axes": []}, lambda _: 5.0)


def fill(service: Service, study_id: str, function: Function) -> None:
    """Rows whose every result is that function of the parameters."""
    store = service.store
    record, study = store.studies.get(study_id), store.studies.study(study_id)
    epoch = store.work.take_over("test")
    for chunk in store.work.claim(epoch, store.work.open_chunks(record.number)):
        columns = {**study.base, **study.columns(range(chunk.first, chunk.last + 1))}
        y = np.broadcast_to(function(columns), chunk.count)
        values = np.repeat(y[:, None], len(models.study_results(study)), axis=1)
        store.work.commit(epoch, chunk, ChunkResult(chunk.first, ["ok"] * chunk.count, [""] * chunk.count, values))
    store.work.settle(epoch, record.number)


def test_the_interface_tells_effects_and_axes_without_any(service: Service, spec: dict[str, Any]) -> None:
    study_id = service.submit(spec)
    assert service.get(f"/studies/{study_id}")["warnings"] == []
    fill(service, study_id, lambda p: p["shaft.load"])
    found = service.get(f"/studies/{study_id}/sensitivity", y=[SPEED, "torque.max"])
    fits(results.SensitivityReport, found)
    assert [item["result"] for item in found["results"]] == [SPEED, "torque.max"]
    effect = {effect["paths"][0]: effect for effect in found["results"][0]["effects"]}
    assert effect["shaft.load"]["first_order"] == pytest.approx(1.0)
    assert effect["excitation.frequency"]["total"] == pytest.approx(0.0)
    sentence = "/axes/0 (excitation.frequency): was varied, but changes no result in any case"
    for answer in (found, service.get(f"/studies/{study_id}")):
        assert (answer["warnings"], answer["warning_codes"]) == ([sentence], ["no-effect"])
    table = service.http.get(f"{API}/studies/{study_id}/sensitivity?y={SPEED}&format=csv").text
    rows = list(csv.DictReader(io.StringIO(table)))
    assert [row["paths"] for row in rows if not row["other_paths"]] == [
        path for effect in found["results"][0]["effects"] for path in effect["paths"]
    ]
    for form, start in (("svg", b"<?xml"), ("png", b"\x89PNG"), ("pdf", b"%PDF")):
        picture = service.http.get(f"{API}/studies/{study_id}/sensitivity?y={SPEED}&format={form}")
        assert picture.content.startswith(start)
    refused = service.http.get(f"{API}/studies/{study_id}/sensitivity?y=shaft.speed.men")
    assert refused.status_code == 422
    assert "did you mean 'shaft.speed.mean'" in refused.json()["errors"][0]["message"]


def test_pairs_and_elementary_effects_are_in_every_form(
    service: Service, spec: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    spans = [{"path": "shaft.load", "from": 0, "to": 1}, {"path": "excitation.frequency", "from": 16, "to": 30}]
    three = [*spans, {"path": "pendulums.0.arm", "from": "20 mm", "to": "30 mm"}]
    pair = {"sample": "saltelli", "count": 32, "second_order": True, "ranges": three}
    for sample, column, heading in (
        (pair, "second_order", "second order"),
        ({"sample": "morris", "count": 8, "ranges": spans}, "mu_star", "mu*"),
    ):
        study_id = service.submit({**spec, "axes": [sample]})
        fill(service, study_id, lambda p: p["shaft.load"] * p["excitation.frequency"])
        place = f"{API}/studies/{study_id}/sensitivity?y={SPEED}"
        answer = service.http.get(place).json()
        fits(results.SensitivityReport, answer)
        rows = list(csv.DictReader(io.StringIO(service.http.get(f"{place}&format=csv").text)))
        (found,) = answer["results"]
        numbers = [item[column] for item in [*found["effects"], *found["pairs"]] if column in item]
        assert numbers
        assert [float(row[column]) for row in rows if row[column]] == numbers
        assert service.http.get(f"{place}&format=svg").status_code == 200
        _show_effects(found)
        assert heading in capsys.readouterr().out
        page = service.http.get(f"/studies/{study_id}/matters?y={SPEED}&units=si").text
        for number in numbers:
            assert f'<td class="num">{number_text(number, 3)}</td>' in page
    assert service.http.get(f"/studies/{study_id}/matters?y=shaft.speed.men").status_code == 422


@pytest.mark.parametrize(
    "axes",
    [
        [{"path": "shaft.load", "linspace": [0, 1, 40]}, {"path": "excitation.frequency", "linspace": [16, 30, 300]}],
        [{"sample": "saltelli", "count": 64, "ranges": [
            {"path": "shaft.load", "from": 0, "to": 1}, {"path": "excitation.frequency", "from": 16, "to": 30}]}],
    ],
)  # fmt: skip
def test_axes_without_any_effect_are_found_in_grids_and_samples(axes: list[Any]) -> None:
    study = parsed({"/axes": axes}).study
    (sentence,) = unaffected(study, fetching(study, lambda p: np.sqrt(p["excitation.frequency"])))
    assert sentence.partition(" ")[2].startswith("(shaft.load): was varied, but changes no result")
    assert unaffected(study, fetching(study, lambda p: p["excitation.frequency"] + p["shaft.load"])) == ()
    # An effect in a corner of the grid only is an effect.
    late = fetching(study, lambda p: np.where(p["excitation.frequency"] > 29.0, p["shaft.load"], 0.0))
    assert [text.split()[0] for text in unaffected(study, late)] == []


def test_without_cases_that_differ_in_one_axis_nothing_is_said() -> None:
    study = parsed({"/axes": [{"points": "shaft.load,excitation.frequency\n0.1,20\n0.2,30\n"}]}).study
    assert unaffected(study, fetching(study, lambda _: 1.0)) == ()
