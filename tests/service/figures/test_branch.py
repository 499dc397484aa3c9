"""Figures of branches from made-up ones."""

from __future__ import annotations

import numpy as np

from sprag_study.service.figures.branch import branch_figure, stable_segments
from sprag_study.service.views.branch import neighbours, usual_along
from sprag_study.worker.models.branches import Along, BranchContact, CaseBranch, SpecialPoint
from sprag_study.worker.study import Axis, Study

ALONG = Along(("shaft.load",), 0.0, 4.0)


def study() -> Study:
    """Two loads beside two frequencies."""
    axes = (Axis(("excitation.frequency",), [20.0, 25.0]), Axis(("shaft.load",), [1.0, 2.0, 9.0]))
    return Study("vibration-drive", "drive", {"gravity": 9.8}, {}, axes)


def made() -> CaseBranch:
    """Stable up to a fold, unstable back to a grazing, and stable from there on."""
    parameters = np.array([0.0, 2.0, 3.0, 2.5, 1.0, 1.0, 0.5])
    stable = np.array([True, True, False, False, False, True, True])
    specials = (
        SpecialPoint("fold", "", 3.0, 2, (1.0 + 0j,), ()),
        SpecialPoint("grazing", "", 1.0, 4, (1.5 + 0j,), (BranchContact("shaft", "take_up", 0, 1),)),
    )
    values = np.arange(7.0)[:, None]
    ends = ("the end of the range", "the end of the range")
    return CaseBranch(0.0, 2, parameters, np.ones(7), stable, ("speed",), ("rad/s",), values, specials, ends)


def test_stable_parts_are_full_and_unstable_ones_dashed() -> None:
    assert stable_segments(made()).tolist() == [True, True, False, False, False, True]
    figure = branch_figure(made(), study(), ALONG, "speed")
    full, dashed, fold, grazing = figure.panels[0].lines
    assert (full.name, full.style, dashed.name, dashed.style) == ("stable", 0, "unstable", 1)
    np.testing.assert_array_equal(full.y, [0.0, 1.0, 2.0, np.nan, 5.0, 6.0])
    np.testing.assert_array_equal(dashed.y, [2.0, 3.0, 4.0, 5.0])
    assert (fold.name, fold.y.tolist(), fold.ring) == ("fold at 3 N·m", [2.0], True)
    assert grazing.name == "grazing at 1 N·m: shaft take up 0 → 1"
    assert figure.heading == "orbits of 2 excitation periods"


def test_cases_beside_a_branch_differ_in_its_parameter_only() -> None:
    assert usual_along(study()) == "shaft.load"
    assert neighbours(study(), 4, ALONG).tolist() == [3, 4]
    assert neighbours(study(), 4, Along(("gravity",), 0.0, 20.0)).tolist() == []
