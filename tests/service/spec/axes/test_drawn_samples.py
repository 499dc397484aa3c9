"""Samples drawn from distributions: the same ones as those of tolerances."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

from tests.service.spec_sample import changed, parsed, problems, schema

MASS, LOAD = "pendulums.0.mass", "shaft.load"


def sample(*ranges: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"/axes": [{"sample": "sobol", "count": 1024, "seed": 1, "ranges": list(ranges), **more}]}


def columns_of(changes: dict[str, Any]) -> dict[str, Any]:
    schema().validate(changed(changes))
    study = parsed(changes).study
    return study.columns(range(study.cases))


@pytest.mark.parametrize("method", ["sobol", "latin_hypercube", "random"])
def test_values_have_their_distribution(method: str) -> None:
    found = columns_of(
        sample(
            {"path": MASS, "plus_minus": "30 %"},
            {"path": LOAD, "nominal": "0.2 N*m", "plus_minus": "50 N*mm", "distribution": "triangular"},
            {"path": "shaft.inertia", "values": [1e-3, 2e-3]},
            {"path": "gravity", "from": 9.0, "to": 10.0},
            sample=method,
        )
    )
    assert stats.kstest(found[MASS], stats.norm(0.5, 0.05).cdf).pvalue > 0.01
    assert stats.kstest(found[LOAD], stats.triang(0.5, 0.15, 0.1).cdf).pvalue > 0.01
    assert stats.kstest(found["gravity"], stats.uniform(9.0, 1.0).cdf).pvalue > 0.01
    assert set(found["shaft.inertia"]) == {1e-3, 2e-3}


def test_two_deviations_are_on_either_side_of_the_nominal_value() -> None:
    angle = "pendulums.0.initial_angle"
    parts = (
        {"path": LOAD, "nominal": "0.2 N*m", "plus_minus": "+50 N*mm/-0", "distribution": "uniform"},
        # Shares are of the size of a value: 10 % more of a negative one is further below 0.
        {"path": angle, "nominal": -1, "plus_minus": "+10/-0 %", "distribution": "uniform"},
    )
    found = columns_of(sample(*parts))
    assert stats.kstest(found[LOAD], stats.uniform(0.2, 0.05).cdf).pvalue > 0.01
    assert stats.kstest(found[angle], stats.uniform(-1.1, 0.1).cdf).pvalue > 0.01


def test_the_parts_of_a_sample_may_be_correlated() -> None:
    parts = ({"path": MASS, "plus_minus": "30 %"}, {"path": LOAD, "nominal": 0.2, "plus_minus": "10 %"})
    found = columns_of(sample(*parts, correlations=[{"between": [MASS, LOAD], "coefficient": 0.7}]))
    assert np.corrcoef(found[MASS], found[LOAD])[0, 1] == pytest.approx(0.7, abs=0.01)


def test_a_sample_over_ranges_is_drawn_as_before() -> None:
    found = columns_of(sample({"path": LOAD, "from": 0.1, "to": 0.2}, {"path": MASS, "from": 0.4, "to": 0.6}, count=4))
    unit = stats.qmc.Sobol(2, rng=np.random.default_rng(1)).random(4)
    np.testing.assert_array_equal(found[LOAD], 0.1 + 0.1 * unit[:, 0])


@pytest.mark.parametrize(
    ("changes", "field", "code"),
    [
        (sample({"path": MASS, "distribution": "normal"}), "ranges/0/plus_minus", "required"),
        (sample({"path": MASS, "plus_minus": "5 %", "from": 1}), "ranges/0/from", "unknown-field"),
        (sample({"path": "pendulums.0.initial_angle", "plus_minus": "5 %"}), "ranges/0/plus_minus", "out-of-range"),
        (sample({"path": MASS, "nominal": 2, "plus_minus": "+20/-5 g"}), "ranges/0/nominal", "ambiguous-unit"),
        (sample({"path": MASS, "values": [1], "plus_minus": "5 %"}), "ranges/0/plus_minus", "conflict"),
        (sample({"path": MASS, "nominal": -1, "plus_minus": "5 %"}), "ranges/0/nominal", "out-of-range"),
        (
            sample({"path": MASS, "plus_minus": "5 %"}, {"path": LOAD, "from": 0, "to": 1}, sample="morris", count=4),
            "ranges/0",
            "conflict",
        ),
        (
            sample({"path": MASS, "plus_minus": "5 %"}, sample="saltelli", correlations=[]),
            "correlations",
            "conflict",
        ),
        (
            sample({"path": MASS, "plus_minus": "5 %"}, correlations=[{"between": [MASS, LOAD], "coefficient": 0.1}]),
            "correlations/0/between",
            "invalid-path",
        ),
    ],
)
def test_what_is_refused_names_its_place(changes: dict[str, Any], field: str, code: str) -> None:
    assert {where: fault.code for where, fault in problems(changes).items()}[f"/axes/0/{field}"] == code


def test_a_sample_behind_a_wrong_axis_tells_all_its_faults() -> None:
    parts = ({"path": MASS, "plus_minus": "5 %"}, {"path": LOAD, "nominal": 0.2, "plus_minus": "5 %"})
    wrong = sample(*parts, correlations=[{"between": [MASS, "nope"], "coefficient": 0.1}])
    together = [{"path": "nonsense", "values": [1]}, *wrong["/axes"]]
    assert set(problems({**wrong, "/axes": together})) == {"/axes/0/path", "/axes/1/correlations/0/between"}
