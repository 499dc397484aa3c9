"""Lines of pictures join points of one regime, and what is not periodic is marked."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from sprag_study.sentences import Amount
from sprag_study.service.figures.curves import curves_figure, doubtful_marks
from sprag_study.service.figures.pictures import draw_compare, draw_curves
from sprag_study.service.figures.pictures import draw_map as paint_map
from sprag_study.service.figures.svg import svg
from sprag_study.service.http.web.motion import _said
from sprag_study.service.languages import language
from sprag_study.service.reading.reader import Reading, shown
from sprag_study.service.results.curve_cases import draw, draw_map, select
from sprag_study.service.results.curves import CurveQuery, Curves
from sprag_study.service.results.regimes import MARKS, coasting_sentence, counted, regimes_of, stretches
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.storage.studies.records import CaseColumns, CaseRow
from sprag_study.worker import models
from sprag_study.worker.study import Study
from tests.acceptance.processes import EXAMPLES
from tests.service.figures.seen import seen
from tests.service.spec_sample import changed

READING = Reading("vibration-drive")
#: Periods after which the motion repeats, for each of `REGIMES`.
ORDERS = [1.0, 2.0, 1.0, np.nan, 4.0, np.nan, np.nan, np.nan]
REGIMES = ["coasting", "periodic", "periodic", "irregular", "periodic", "unsettled", "unsettled", None]


def joined(regimes: list[str | None] | None, points: int = 0) -> list[list[int]]:
    usable = np.array([name != "unsettled" for name in regimes or [""] * points])
    return [stretch.tolist() for stretch in stretches(regimes, len(usable), usable)]


def test_a_line_joins_neighbours_of_one_regime_and_no_unsettled_point() -> None:
    assert joined(REGIMES) == [[0, 1, 2], [3], [4], [5], [6]]
    assert joined(["held", "coasting", "periodic", "held"]) == [[0], [1, 2], [3]]
    assert joined(["irregular"] * 3) == [[0, 1, 2]]
    assert joined(["periodic", None, "periodic"]) == [[0], [2]]
    assert joined(None, 8) == [list(range(8))]
    assert joined([]) == []
    counts = np.array([True, False, True, True])
    assert [part.tolist() for part in stretches(None, 4, counts)] == [[0], [1], [2, 3]]


def test_regimes_are_told_in_one_order_and_counted_in_words() -> None:
    assert regimes_of([REGIMES, None]) == ["periodic", "coasting", "irregular", "unsettled"]
    assert (
        counted({"periodic": 48600, "irregular": 24, "unsettled": 2})
        == "48\N{NARROW NO-BREAK SPACE}600 periodic, 24 irregular, 2 unsettled"
    )
    assert set(MARKS) | {"none"} == set(models.REGIME_SENTENCES)


def study(loads: int, frequencies: int = 1) -> Study:
    axes = [
        {"path": "excitation.frequency", "values": [20.0 + index for index in range(frequencies)]},
        {"path": "shaft.load", "linspace": [0, 0.7, loads]},
    ]
    return parse_spec(changed({"/run": {"until": "settled"}, "/axes": axes})).study


def fetched(cases: np.ndarray[tuple[int], np.dtype[np.int64]], names: list[str]) -> CaseColumns:
    """Rows whose regimes go along `REGIMES`; the speed is the number of the case."""
    places = [REGIMES[case % 8] for case in cases.tolist()]
    codes = [np.nan if name is None else list(models.REGIME_SENTENCES).index(name) for name in places]
    columns = {name: np.array(codes) if name == "regime" else cases.astype(float) for name in names}
    if "regime.order" in columns:
        columns["regime.order"] = np.array([ORDERS[case % 8] for case in cases.tolist()])
    for column in columns.values():
        column[[name is None for name in places]] = np.nan
    flags = [name if name in ("irregular", "unsettled") else "" for name in places]
    return CaseColumns(cases, ["ok" if name else "chatter" for name in places], columns, flags)


def drawn() -> Curves:
    one = study(8)
    return draw(select(one, CurveQuery("shaft.load", ("shaft.speed.mean",))), fetched)


def test_a_figure_breaks_lines_and_marks_regimes() -> None:
    page = svg(curves_figure([("", drawn())]), cases="/studies/st_0/cases/")
    (panel,) = seen(page).panels
    (line,) = panel.curves
    assert [len(stretch) for stretch in line.stretches] == [3, 1, 1, 1, 1]
    assert sorted(panel.cases) == [0, 0, 1, 2, 3, 3, 4, 5, 5, 6, 6]
    assert seen(page).has("periodic", "coasting", "irregular", "unsettled")
    plain = (replace(curve, regimes=None, orders=None, usable=None) for curve in drawn().curves)
    transient = replace(drawn(), curves=tuple(plain))
    (panel,) = seen(svg(curves_figure([("", transient)]), cases="/studies/st_0/cases/")).panels
    assert panel.cases == list(range(7))  # the last one has no result


def test_a_picture_names_the_regimes_that_occur() -> None:
    with_marks = draw_curves(drawn(), "", "svg", READING)
    plain = (replace(curve, regimes=["periodic"] * 8, orders=[1] * 8) for curve in drawn().curves)
    periodic = replace(drawn(), curves=tuple(plain))
    assert with_marks.count(MARKS["unsettled"].colour.encode()) > 0
    assert MARKS["unsettled"].colour.encode() not in draw_curves(periodic, "", "svg", READING)


def test_pictures_of_several_plots_have_room_for_plots_and_marks() -> None:
    one = study(8, 2)
    query = CurveQuery("shaft.load", ("shaft.speed.mean", "torque.mean"), ("excitation.frequency",))
    curves = draw(select(one, query), fetched)
    both = [("a", curves), ("b", curves)]
    for picture in (draw_curves(curves, "A study", "svg", READING), draw_compare(both, READING, "svg")):
        assert seen(picture).texts.count("unsettled") == 1


@pytest.mark.parametrize("name", ["irregular", "unsettled"])
def test_a_map_marks_what_is_not_periodic(name: str) -> None:
    two = study(8, 2)
    found = draw_map(two, "shaft.load", "excitation.frequency", "shaft.speed.mean", (), fetched)
    marks = {marks.regime: marks.cases.tolist() for marks in doubtful_marks(found)}
    assert marks[name] == [case for case in range(16) if REGIMES[case % 8] == name]
    assert found.to_json()["regime"][1] == REGIMES
    assert found.to_json()["order"][1] == [None if np.isnan(order) else int(order) for order in ORDERS]
    assert MARKS[name].colour.encode() in paint_map(found, "", "svg")


def test_a_case_without_a_load_says_to_which_speed_its_motion_over_time_comes() -> None:
    spec = json.loads((EXAMPLES / "one_pendulum.json").read_text(encoding="utf-8"))
    spec["axes"] = [{"path": "shaft.load", "values": [0, "0.1 N*m"]}]
    study = parse_spec(spec).study
    done, infos = models.run_chunk(study, 0, 2), models.study_results(study)
    coasting, loaded = (
        {info.name: value for info, value in zip(infos, row, strict=True)} for row in done.values.tolist()
    )
    said = coasting_sentence(coasting)
    assert said is not None
    motion = models.run_trajectory(study, 0, 3.9, 4.0, 50)
    speeds = motion.values[:, list(motion.names).index("shaft.speed")]
    reached = said.parts["reached"]
    assert isinstance(reached, Amount)
    assert speeds == pytest.approx(reached.value, rel=1e-9)
    assert coasting["shaft.speed.mean"] < 0.95 * reached.value
    assert coasting_sentence(loaded) is None
    row = CaseRow(0, models.OK, (), {**coasting, "regime": "coasting", "regime.order": 1})
    assert "own start, comes to 40.9 rad/s and keeps it." in " ".join(_said(study, row))


def test_regimes_agree_with_their_number() -> None:
    text = counted({"periodic": 486, "irregular": 24, "unsettled": 1})
    assert text == "486 periodic, 24 irregular, 1 unsettled"
    with language("uk"):
        assert shown(text) == "486 періодичних, 24 нерегулярні, 1 неусталений"
