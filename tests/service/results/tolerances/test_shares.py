"""Shares of the variance by tolerance, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm, qmc

from sprag_study.service.results.tolerances import causes
from sprag_study.service.results.tolerances.causes import LEAST_DRIVES, Share, shares
from sprag_study.service.results.tolerances.written import causes_sentences
from sprag_study.service.spec.document import parse_spec
from tests.service.results.tolerances.conftest import SPEC


def test_shares_of_a_linear_function_are_those_of_its_slopes() -> None:
    draws = norm.ppf(qmc.Sobol(3, rng=1).random(2048))
    found = shares(draws, draws @ np.array([[3.0], [2.0], [0.0]])) or []
    assert [share.value for share in found] == pytest.approx([9 / 13, 4 / 13, 0.0], abs=0.01)
    assert all(0.0 < share.error < 0.05 for share in found)


def test_shares_of_the_ishigami_function_are_those_of_the_closed_form() -> None:
    x = -np.pi + 2.0 * np.pi * qmc.Sobol(3, rng=2).random(4096)
    y = np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    found = shares(x, y[:, None]) or []
    assert [share.value for share in found] == pytest.approx([0.3139, 0.4424, 0.0], abs=0.02)


def test_intervals_of_shares_hold_over_seeds() -> None:
    held = np.zeros(3)
    for seed in range(200):
        draws = np.random.default_rng(seed).normal(size=(400, 3))
        found = shares(draws, draws @ np.array([[3.0], [2.0], [0.0]])) or []
        exact = (9 / 13, 4 / 13, 0.0)
        held += [abs(share.value - value) <= share.error for share, value in zip(found, exact, strict=True)]
    assert (held / 200 >= 0.91).all(), held


def test_several_columns_share_the_sum_of_their_variances() -> None:
    draws = np.random.default_rng(3).normal(size=(4000, 2))
    found = shares(draws, draws * np.array([3.0, 1.0])) or []
    assert [share.value for share in found] == pytest.approx([0.9, 0.1], abs=0.03)


def test_values_of_a_list_are_groups() -> None:
    rng = np.random.default_rng(4)
    draws = np.column_stack([rng.choice([1.0, 2.0, 5.0], 3000), rng.normal(size=3000)])
    # The mean jumps between groups: variance 2/9 of (0, 1, 0), and 1 of the noise.
    y = (draws[:, 0] == 2.0) + draws[:, 1]
    found = shares(draws, y[:, None].astype(float)) or []
    assert found[0].value == pytest.approx(2 / 11, abs=0.03)
    same = shares(np.ones((100, 1)), rng.normal(size=(100, 1))) or []
    assert [(share.value, share.error) for share in same] == [(0.0, 0.0)]


def test_too_few_drives_and_results_that_do_not_vary_have_no_shares() -> None:
    draws = np.random.default_rng(5).normal(size=(LEAST_DRIVES, 2))
    assert shares(draws[:-1], draws[:-1, :1]) is None
    assert shares(draws, np.full((LEAST_DRIVES, 1), 5.0)) is None
    assert shares(draws, draws[:, :1]) is not None


def test_what_scatters_around_no_share_is_no_interaction(monkeypatch: pytest.MonkeyPatch) -> None:
    study = parse_spec(SPEC).study
    estimates = [Share(0.97, 0.01), Share(-0.1, 0.12), Share(-0.08, 0.12)]
    monkeypatch.setattr(causes, "shares", lambda _draws, _y: estimates)
    found = causes.variance_causes(study, np.zeros((512, 1)))
    assert found.rest == pytest.approx(0.03)
    assert [share and share.value for share in found.shares] == [0.97, -0.1, -0.08]


def test_shares_are_told_apart_from_the_numbers_of_parts() -> None:
    """Captions end with numbers of parts: ``backlash, pendulum 1``."""
    known = causes.Causes((Share(0.5, 0.04), Share(0.3, 0.02), Share(0.2, 0.01)), 0.0)
    (sentence,) = causes_sentences(parse_spec(SPEC).study, known, "speed")
    assert sentence.endswith(": first (50.0 ± 4.0 %); second (30.0 ± 2.0 %); third (20.0 ± 1.0 %).")
