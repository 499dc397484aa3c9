"""Searches that a script asks and tells: the planner of goals, its own results or a script's, resumed bit for bit."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

import sprag_study as sprag
from sprag_study.worker import models
from tests.service.timed_spec import SPEC

FREQUENCY, ARM = "excitation.frequency", "pendulums.0.arm"
VARY = {"frequency": ("20 Hz", "35 Hz"), "arm": ("15 mm", "45 mm")}


def drive() -> sprag.Drive:
    return sprag.Drive.of({**SPEC, "run": {"duration": "12 periods", "window": ["8 periods", "12 periods"]}}).hold(
        load="0.2 N*m"
    )


def cost(designs: pd.DataFrame) -> Any:
    """An objective of the script's own, least at 27 Hz and 30 mm."""
    return (designs[FREQUENCY] - 27.0) ** 2 + 1e4 * (designs[ARM] - 0.03) ** 2


def searched(best: Any = None, **more: Any) -> sprag.Search:
    goal = {"population": 8, "generations": 40, **more}
    return sprag.search(drive().goal(vary=VARY, best=best or {"cost": "min"}, **goal))


def test_told_what_sprag_computes_it_is_the_search_of_a_study() -> None:
    goal = drive().goal(
        vary=VARY, best={"efficiency": "max"}, subject_to=["torque.max <= 3 N*m"], population=4, generations=2
    )
    designs = sprag.run(goal, processes=0).front()["designs"]
    search = sprag.search(goal)
    assert search.values == ("efficiency", "torque.max")
    for asked in search:
        assert asked.attrs["units"] == {FREQUENCY: "Hz", ARM: "m"}
        search.tell(search.run(processes=0).table())
    best = search.best(len(designs))
    assert best[[FREQUENCY, ARM]].to_dict("records") == [design["variables"] for design in designs]
    told = [
        float("nan") if design["goals"]["efficiency"] is None else design["goals"]["efficiency"] for design in designs
    ]
    np.testing.assert_array_equal(best["efficiency"], told)
    assert best["rank"].tolist() == [design["rank"] for design in designs]
    assert best.attrs["units"]["efficiency"] == "1"


def test_an_objective_of_the_script() -> None:
    search, told = searched(), 0
    for designs in search:
        search.tell(cost(designs))
        told += len(designs)
    best = search.best(1).iloc[0]
    np.testing.assert_allclose([best[FREQUENCY], best[ARM]], [27.0, 0.03], rtol=1e-3)
    assert search.done
    assert told <= 8 * 40 + 8 * (2 * 2 + 10), "generations and finish"
    assert repr(search) == f"Search(cost: {told} designs told, ended)"
    assert (len(search.ask()), list(search)) == (0, [])
    with pytest.raises(ValueError, match="has ended"):
        search.tell([])


@pytest.mark.parametrize(
    ("best", "columns"),
    [({"cost": "min"}, ["cost"]), ({"efficiency": "max", "cost": "min"}, ["efficiency", "cost"]), ([], [])],
)
def test_before_anything_is_told_the_best_designs_are_an_empty_table(best: Any, columns: list[str]) -> None:
    goal = {"population": 8, "generations": 2, "subject_to": ["mass <= 3"]}
    search = sprag.search(drive().goal(vary=VARY, best=best, **goal))
    table = search.best(3)
    assert list(table) == [FREQUENCY, ARM, *columns, "feasible", "violation", "rank"]
    assert (len(table), search.best(exact=True).shape) == (0, table.shape)
    assert table.attrs["units"] == {FREQUENCY: "Hz", ARM: "m", **dict.fromkeys(columns, "1")}


@pytest.mark.parametrize("flags", [None, np.nan, pd.NA, "", [], "creep;large", ["creep", "large"]])
def test_flags_of_a_file_are_those_of_a_table(flags: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[str] = []
    usable = models.usable

    def reading(model: str, endings: list[str], texts: list[str]) -> Any:
        read.extend(texts)
        return usable(model, endings, texts)

    monkeypatch.setattr(models, "usable", reading)
    searched().tell({"cost": [1.0] * 8, "ending": ["ok"] * 8, "flags": [flags] * 8})
    assert read == ["creep,large" if isinstance(flags, str | list) and flags else ""] * 8


def test_designs_are_told_by_the_rows_of_a_file(tmp_path: Path) -> None:
    search = searched(generations=2)
    file = search.run(processes=0).export(tmp_path / "rows.csv")
    search.tell(pd.read_csv(file), cost=[1.0] * 8)
    assert len(search.best()) == 8


def test_goals_and_limits_of_both_kinds() -> None:
    """A script's limit beside a result with its unit; several goals; operating points; a value that is missing."""
    search = searched({"torque.max": "min", "mass": "min"}, subject_to=["mass <= 3", "torque.max <= 500 N*mm"],
                      at=[{"shaft.load": "0.1 N*m"}, {"shaft.load": "0.2 N*m"}], generations=2)  # fmt: skip
    designs = search.ask()
    assert designs["shaft.load"].tolist() == [0.1, 0.2] * 8
    torque = np.where(designs[FREQUENCY] > 27.5, 0.4, 0.6)
    torque[:2] = np.nan
    search.tell({"torque.max": torque, "mass": designs[ARM] * 60.0, "further": "ignored"})
    best = search.best()
    assert len(best) == 8
    assert best["feasible"].any()
    feasible = best[best["feasible"]]
    assert (feasible["torque.max"] <= 0.5).all()
    assert (feasible["mass"] <= 3.0).all()
    assert best.iloc[-1]["violation"] > 0.0


@pytest.mark.parametrize("subject_to", [None, {"share": {"is": 0.25, "within": 0.01}}])
def test_a_pickle_goes_on_bit_for_bit(subject_to: Any) -> None:
    """Also with polish and finish, whose rounds follow from derivatives."""

    def told(search: sprag.Search) -> None:
        designs = search.ask()
        search.tell(cost=cost(designs), share=designs[ARM] / 0.12)

    straight, broken = (searched(subject_to=subject_to, generations=6) for _ in range(2))
    while not straight.done:
        told(straight)
        told(broken)
        broken = pickle.loads(pickle.dumps(broken))
        pd.testing.assert_frame_equal(broken.ask(), straight.ask(), check_exact=True)
    assert copy.deepcopy(straight).done
    pd.testing.assert_frame_equal(broken.best(), straight.best(), check_exact=True)
    assert [summary["phase"] for summary in straight._summaries].count("polish") == len(straight._told) - 6 > 0
    if subject_to is not None:
        assert abs(straight.best(1, exact=True)[ARM].item() - 0.03) < 1e-7


def test_designs_run_by_a_service_are_its_cases() -> None:
    asked: dict[str, Any] = {}

    class Service:
        def submit(self, spec: Any, *, cases: Any, **options: Any) -> Any:
            asked.update(options, study=sprag.run(spec, cases=cases, processes=0))
            return asked["study"]

    search = searched(population=4)
    study = search.run(cast("sprag.Client", Service()), priority=3)
    assert asked["priority"] == 3
    np.testing.assert_array_equal(study.table()[[FREQUENCY, ARM]], search.ask())
    assert len(study.trajectory(0, points=5).to_pandas()) == 5


@pytest.mark.parametrize(
    ("tell", "said"),
    [
        (lambda search: search.tell([1.0, 2.0]), r"8 values, one for each row of `ask`"),
        (lambda search: search.tell({"cst": [1.0] * 8}), "a column for cost, too"),
        (lambda search: search.tell(cost=["dear"] * 8), "a number for each design, NaN for none"),
        (lambda search: [*search], "the designs were not told: call `tell` with cost of each"),
    ],
)
def test_what_is_not_told_is_named(tell: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        tell(searched())


def test_a_search_needs_a_goal_and_names_what_is_wrong_with_it() -> None:
    with pytest.raises(sprag.SpragError, match="a spec with a goal"):
        sprag.search(drive())
    with pytest.raises(sprag.SpragError, match="without tolerances"):
        sprag.search(drive().goal(vary=VARY, best={"cost": "min"}).set(tolerances={"mass": "5 %"}, drives=8))
    with pytest.raises(sprag.SpecError, match="/goal/subject_to/0/at_most"):
        searched(subject_to=["cost <= 3 EUR"])
    with pytest.raises(sprag.SpecError, match="unknown result"):
        sprag.run(drive().goal(vary=VARY, best={"cost": "min"}))
