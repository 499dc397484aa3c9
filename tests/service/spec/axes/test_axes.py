"""Axes of a spec: paths, values of every kind, sizes before expansion, grids and zips, clutch laws along them."""

from __future__ import annotations

import copy
import tracemalloc
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sprag_study.service.spec.axes.values import _steps
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker.limits import MAX_AXES, MAX_AXIS_VALUES, MAX_CASES
from tests.service.spec_sample import SPEC, changed, parsed, problems

PENDULUM = SPEC["base"]["pendulums"][0]


def values_of(path: str | list[str], **way: Any) -> tuple[float, ...]:
    """SI values of a single axis."""
    (axis,) = parsed({"/axes": [{"path": path, **way}]}).study.axes
    return axis.values


def only_problem(*axes: Any, **changes: Any) -> tuple[str, str]:
    """Pointer and code of the one fault of these axes."""
    found = problems({"/axes": list(axes)} | {f"/{key}": value for key, value in changes.items()})
    (problem,) = found.values()
    return str(problem.where), problem.code


def load(**way: Any) -> dict[str, Any]:
    return {"path": "shaft.load", **way}


@pytest.mark.parametrize(
    ("way", "expected"),
    [
        ({"values": ["0.3 N*m", "100 N*mm", 0]}, [0.3, 0.1, 0.0]),
        ({"values": [-0.0]}, [0.0]),
        ({"linspace": [0, 1, 5]}, [0.0, 0.25, 0.5, 0.75, 1.0]),
        ({"linspace": [1, 0, 3]}, [1.0, 0.5, 0.0]),
        ({"linspace": [0.02, "0.3 N*m", 8]}, [0.02, 0.06, 0.1, 0.14, 0.18, 0.22, 0.26, 0.3]),
        ({"linspace": [2, 2, 1]}, [2.0]),
        ({"geomspace": [1, 1000, 4]}, [1.0, 10.0, 100.0, 1000.0]),
        ({"geomspace": [8, 1, 4]}, [8.0, 4.0, 2.0, 1.0]),
        ({"geomspace": [3, 3, 1]}, [3.0]),
        ({"range": [0, 0.3, 0.1]}, [0.0, 0.1, 0.2, 0.3]),
        ({"range": [0, 0.35, 0.1]}, [0.0, 0.1, 0.2, 0.3]),
        ({"range": [0.3, 0, -0.1]}, [0.3, 0.2, 0.1, 0.0]),
        ({"range": [1, 1, 5]}, [1.0]),
        ({"range": [0, 0.1 + 0.2, 0.1]}, [0.0, 0.1, 0.2, 0.1 + 0.2]),
        ({"range": [0, 0.29999999999999993, 0.1]}, [0.0, 0.1, 0.2, 0.29999999999999993]),
        ({"range": ["0 N*m", "300 N*mm", "0.1 N*m"]}, [0.0, 0.1, 0.2, 0.3]),
    ],
)
def test_values(way: dict[str, Any], expected: list[float]) -> None:
    found = values_of("shaft.load", **way)
    if "geomspace" in way:
        assert found == pytest.approx(expected, rel=1e-14)
        assert (found[0], found[-1]) == (expected[0], expected[-1])
    else:
        assert list(found) == expected
    assert not any(np.signbit(found))


def test_negative_geometric_ranges() -> None:
    assert values_of("pendulums.0.arm", geomspace=["-1 mm", "-100 mm", 3]) == pytest.approx((-0.001, -0.01, -0.1))


@given(
    st.decimals("0", "1000", places=3), st.decimals("0.001", "1000", places=3), st.integers(1, 300)
)  # fmt: skip
def test_steps_are_decimals(start: Any, step: Any, count: int) -> None:
    last = start + step * (count - 1)
    expected = [float(Fraction(start) + index * Fraction(step)) for index in range(count)]
    assert list(values_of("shaft.load", range=[f"{start} N*m", f"{last} N*m", f"{step} N*m"])) == expected
    if count > 1:
        assert list(values_of("shaft.load", linspace=[f"{start} N*m", f"{last} N*m", count])) == expected


def test_frequencies_in_other_units() -> None:
    assert values_of("excitation.frequency", range=["600 rpm", "1800 rpm", "600 rpm"]) == (10.0, 20.0, 30.0)
    assert values_of("excitation.frequency", values=["1500 rpm", "26 Hz", "180 rad/s"])[:2] == (25.0, 26.0)


def test_tied_paths_and_every_kind_of_path() -> None:
    study = parsed(
        {
            "/base/pendulums": [PENDULUM, PENDULUM],
            "/base/clutch/windup_limit": "5 deg",
            "/axes": [
                {"path": ["pendulums.0.spring_rate", "pendulums.1.spring_rate"], "values": [8000, 9000]},
                {"path": "clutch.coefficients.1", "values": ["100 N*m/rad", 200]},
                {"path": "clutch.windup_limit", "values": ["1 deg", "0.2 rad"]},
                {"path": "gravity", "values": [0, 9.81]},
            ],
        }
    ).study
    assert study.cases == 16
    assert study.axes[0].paths == ("pendulums.0.spring_rate", "pendulums.1.spring_rate")
    own = [copy.deepcopy(PENDULUM) | {"clutch": {"coefficients": [0, 200]}} for _ in range(2)]
    path = ["pendulums.0.clutch.coefficients.1", "pendulums.1.clutch.coefficients.1"]
    changes = {"/base/pendulums": own, "/base/clutch": ..., "/axes": [{"path": path, "values": [100, 300]}]}
    assert parsed(changes).study.case_parameters(1) == dict.fromkeys(path, 300.0)
    unlimited = parsed({"/axes": [{"path": "clutch.windup_limit", "values": [0.1, 0.2]}]}).study
    assert "clutch.windup_limit" not in unlimited.base


@pytest.mark.parametrize(
    ("path", "code"),
    [
        ("shaft.laod", "invalid-path"),
        ("base.shaft.load", "invalid-path"),
        ("excitation", "invalid-path"),
        ("name", "invalid-path"),
        ("run.duration", "invalid-path"),
        ("", "invalid-path"),
        ("pendulums.1.mass", "invalid-path"),
        ("pendulums.999999999.mass", "invalid-path"),
        ("pendulums.-1.mass", "invalid-path"),
        ("pendulums.N.mass", "invalid-path"),
        ("pendulums.0.massa", "invalid-path"),
        ("clutch.coefficients.4", "invalid-path"),
        ("clutch.coefficients", "invalid-path"),
        ("clutch.data.0.1", "invalid-path"),
        ("pendulums.0.clutch.coefficients.1", "invalid-path"),
        (3, "wrong-type"),
        (None, "required"),
        ([], "wrong-type"),
        (["shaft.load", 3], "wrong-type"),
        (["shaft.load"] * 300, "wrong-type"),
        (["shaft.load", "excitation.frequency"], "wrong-unit"),
        (["shaft.load", "shaft.load"], "repeated"),
        (["clutch.coefficients.1", "clutch.coefficients.2"], "wrong-unit"),
        ("x" * 10_000, "invalid-path"),
    ],
)
def test_paths_that_are_refused(path: object, code: str) -> None:
    pointer, told = only_problem({"path": path, "values": [1, 2]})
    assert pointer.startswith("/axes/0/path")
    assert told == code


def test_clutch_paths_follow_where_the_clutch_stands() -> None:
    own = [copy.deepcopy(PENDULUM) | {"clutch": {"coefficients": [0, 200]}}]
    changes = {"/base/pendulums": own, "/base/clutch": ..., "/axes": [{"path": "clutch.coefficients.1", "values": [1]}]}
    assert "pendulums.0.clutch.coefficients.1" in problems(changes)["/axes/0/path"].message


@pytest.mark.parametrize("path", ["clutch.coefficients.1", "clutch.windup_limit"])
def test_a_fitted_clutch_is_not_varied(path: str) -> None:
    data = {"data": [[0, 0], [0.01, 2], [0.02, 4]], "accuracy": 0.1}
    found = problems({"/base/clutch": data, "/axes": [{"path": path, "values": [1]}]})
    assert found["/axes/0/path"].code == "invalid-path"


def test_a_path_stands_on_one_axis() -> None:
    tied = {"path": ["gravity", "gravity"], "values": [1]}
    found = only_problem(load(values=[1]), tied | {"path": "gravity"}, load(values=[2]))
    assert found == ("/axes/2/path", "repeated")


@pytest.mark.parametrize(
    ("way", "at", "code"),
    [
        ({}, "", "exactly-one"),
        ({"values": [1], "linspace": [0, 1, 2]}, "", "exactly-one"),
        ({"values": []}, "/values", "empty"),
        ({"values": 3}, "/values", "wrong-type"),
        ({"values": {"0": 1}}, "/values", "wrong-type"),
        ({"values": [1, -2, 3]}, "/values/1", "out-of-range"),
        ({"values": [1, "2 m"]}, "/values/1", "wrong-unit"),
        ({"values": [1, None]}, "/values/1", "wrong-type"),
        ({"values": [1, True]}, "/values/1", "wrong-type"),
        ({"values": [1, [2]]}, "/values/1", "wrong-type"),
        ({"values": [1, float("nan")]}, "/values/1", "not-finite"),
        ({"values": [1, 2, 1]}, "/values/2", "repeated"),
        ({"values": ["1 N*m", "1000 N*mm"]}, "/values/1", "repeated"),
        ({"linspace": [0, 1]}, "/linspace", "wrong-type"),
        ({"linspace": [0, 1, 2, 3]}, "/linspace", "wrong-type"),
        ({"linspace": [0, 1, 0]}, "/linspace/2", "out-of-range"),
        ({"linspace": [0, 1, -3]}, "/linspace/2", "out-of-range"),
        ({"linspace": [0, 1, 2.0]}, "/linspace/2", "wrong-type"),
        ({"linspace": [0, 1, "3"]}, "/linspace/2", "wrong-type"),
        ({"linspace": [0, 1, True]}, "/linspace/2", "wrong-type"),
        ({"linspace": [0, 1, 1]}, "/linspace/2", "invalid-range"),
        ({"linspace": [1, 1, 2]}, "/linspace", "repeated"),
        ({"linspace": [-1, 1, 3]}, "/linspace/0", "out-of-range"),
        ({"linspace": [0, "1 Hz", 3]}, "/linspace/1", "wrong-unit"),
        ({"geomspace": [0, 1, 3]}, "/geomspace", "invalid-range"),
        ({"geomspace": [1, 10, 1]}, "/geomspace/2", "invalid-range"),
        ({"range": [0, 1, 0]}, "/range/2", "invalid-range"),
        ({"range": [0, 1, -0.1]}, "/range/2", "invalid-range"),
        ({"range": [1, 0, 0.1]}, "/range/2", "invalid-range"),
        ({"range": [0, 1, "0.1 Hz"]}, "/range/2", "wrong-unit"),
        ({"range": [0, 1]}, "/range", "wrong-type"),
    ],
)
def test_values_that_are_refused(way: dict[str, Any], at: str, code: str) -> None:
    assert only_problem(load(**way)) == ("/axes/0" + at, code)


def test_a_change_of_sign_in_a_geometric_range() -> None:
    found = only_problem({"path": "pendulums.0.arm", "geomspace": [-1, 1, 3]})
    assert found == ("/axes/0/geomspace", "invalid-range")


@pytest.mark.parametrize(
    ("axes", "at", "code"),
    [
        ([load(linspace=[0, 1, 10**9])], "/axes/0/linspace/2", "out-of-range"),
        ([load(linspace=[0, 1, 10**300])], "/axes/0/linspace/2", "out-of-range"),
        ([load(geomspace=[1, 2, 10**9])], "/axes/0/geomspace/2", "out-of-range"),
        ([load(range=[0, 1, "1e-9 N*m"])], "/axes/0/range", "too-many"),
        ([load(range=[0, 1e9, 1e-300])], "/axes/0/range", "too-many"),
        (
            [{"path": path, "linspace": [1, 2, 1000]} for path in ("shaft.load", "gravity", "excitation.phase")],
            "/axes",
            "too-many",
        ),
        (
            [{"path": path, "linspace": [1, 2, MAX_AXIS_VALUES]} for path in ("shaft.load", "gravity")],
            "/axes",
            "too-many",
        ),
        ([load(values=[1])] * (MAX_AXES + 1), "/axes", "wrong-type"),
        ({"path": "shaft.load"}, "/axes", "wrong-type"),
        (None, "/axes", "wrong-type"),
        (["shaft.load"], "/axes/0", "wrong-type"),
    ],
)
def test_sizes_are_checked_before_expansion(axes: Any, at: str, code: str) -> None:
    tracemalloc.start()
    try:
        (problem,) = problems({"/axes": axes}).values()
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert (problem.where, problem.code) == (at, code)
    assert peak < 2_000_000


@pytest.mark.parametrize(
    ("axes", "combine"),
    [
        ([load(linspace=[0.01, 0.5, MAX_AXIS_VALUES])], "grid"),
        ([load(values=[index / 1e6 for index in range(MAX_AXIS_VALUES)])], "grid"),
        ([load(linspace=[0.01, 0.5, 500_000]), {"path": "gravity", "linspace": [9, 10, 500_000]}], "zip"),
    ],
)
def test_a_million_values_are_never_python_numbers_one_by_one(axes: Any, combine: str) -> None:
    spec = changed({"/axes": axes, "/combine": combine})
    tracemalloc.start()
    try:
        study = parse_spec(spec).study
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert sum(map(len, study.axes)) == MAX_AXIS_VALUES
    assert peak < 60_000_000  # a few arrays; as Python numbers with their places they take 150 MB


@given(
    st.fractions(-100, 100, max_denominator=10**9),
    st.fractions(-100, 100, max_denominator=10**9),
    st.integers(2, 50),
)
def test_every_value_of_a_division_is_the_nearest_double(start: Fraction, stop: Fraction, count: int) -> None:
    step = (stop - start) / (count - 1)
    expected = [float(start + index * step) for index in range(count)]
    assert _steps(start, step, count).tolist() == expected
    whole = start.limit_denominator(100), step.limit_denominator(100)
    assert _steps(*whole, count).tolist() == [float(whole[0] + index * whole[1]) for index in range(count)]


def test_the_first_fault_of_a_long_list_is_told() -> None:
    values = [index / 100.0 for index in range(1000)]
    repeated = [*values, 0.5, 0.25]
    assert only_problem(load(values=repeated)) == ("/axes/0/values/1000", "repeated")
    assert only_problem(load(values=[*values, -1.0, 0.5]))[0] == "/axes/0/values/1000"


def test_the_largest_grid() -> None:
    axes = [{"path": path, "linspace": [1, 2, 1000]} for path in ("shaft.load", "gravity")]
    assert parsed({"/axes": [*axes, {"path": "excitation.phase", "linspace": [0, 1, 10]}]}).study.cases == MAX_CASES


def test_zips() -> None:
    zipped = [load(values=[1, 1, 2]), {"path": "gravity", "linspace": [9, 10, 3]}]
    study = parsed({"/axes": zipped, "/combine": "zip"}).study
    assert (study.cases, study.case_parameters(1)) == (3, {"shaft.load": 1.0, "gravity": 9.5})
    unequal = problems({"/axes": [load(values=[1, 2]), {"path": "gravity", "values": [1]}], "/combine": "zip"})
    assert unequal["/axes"].code == "unequal-lengths"
    twice = problems({"/axes": [load(values=[1, 2, 1]), {"path": "gravity", "values": [1, 2, 1]}], "/combine": "zip"})
    assert twice["/axes"].code == "repeated"


@pytest.mark.parametrize("combine", ["Grid", "product", 3, None, ["grid"]])
def test_combine(combine: object) -> None:
    assert list(problems({"/combine": combine})) == ["/combine"]


LAW_AXES = [
    {"path": "clutch.coefficients.1", "values": [200, 100]},
    {"path": "clutch.coefficients.3", "values": [20000, -20000]},
]


def test_a_law_negative_somewhere_on_a_grid() -> None:
    found = problems({"/axes": [load(values=[1]), *LAW_AXES]})
    assert list(found) == ["/axes/1"]
    assert found["/axes/1"].value == [0.0, 100.0, 0.0, -20000.0]
    assert found["/axes/1"].code == "no-clutch-law"
    parsed({"/axes": LAW_AXES, "/base/clutch/windup_limit": 0.05})
    wide = {"path": "clutch.windup_limit", "values": [0.01, 0.08]}
    assert list(problems({"/axes": [*LAW_AXES, wide]})) == ["/axes/0"]
    parsed({"/axes": [LAW_AXES[0]], "/base/clutch/coefficients": [0, -1, 0, 0]})  # the base's own law is never used


def test_a_law_negative_somewhere_in_a_zip() -> None:
    changes = {"/combine": "zip", "/base/clutch/windup_limit": 0.09}
    parsed(changes | {"/axes": [LAW_AXES[0] | {"values": [100, 200]}, LAW_AXES[1]]})
    found = problems(changes | {"/axes": LAW_AXES})
    assert found["/axes/0"].value == [0.0, 100.0, 0.0, -20000.0]
    many = [{"path": f"clutch.coefficients.{k}", "linspace": [-1, k, 20_000]} for k in (1, 3)]
    assert problems({"/axes": many, "/combine": "zip"})["/axes/0"].code == "too-many"


@pytest.mark.parametrize(
    ("changes", "pointer", "value"),
    [
        ({"/axes": [{"path": "excitation.frequency", "values": [25, 25]}]}, "/axes/0/values/1", 25),
        ({"/axes": [{"path": "excitation.frequency", "values": ["25 Hz", "1500 rpm"]}]}, "/axes/0/values/1",
         "1500 rpm"),
        ({"/axes": [{"path": ["pendulums.0.arm", "excitation.amplitude_y"], "values": ["2 mm", "-3 mm"]}]},
         "/axes/0/values/1", "-3 mm"),
        ({"/axes": [{"path": ["pendulums.0.arm", "excitation.amplitude_y"], "linspace": ["-4 mm", "4 mm", 3]}]},
         "/axes/0/linspace", "-0.004 m"),
        ({"/axes": [{"path": "shaft.load", "values": ["1 N*m", "1000 N*mm"]},
                    {"path": "excitation.frequency", "values": ["25 Hz", "1500 rpm"]}], "/combine": "zip"},
         "/axes", ["shaft.load = 1 N*m", "excitation.frequency = 25 Hz"]),
        ({"/axes": [{"sample": "sobol", "count": 4,
                     "ranges": [{"path": "shaft.load", "from": "1 N*m", "to": "1000 N*mm"}]}]},
         "/axes/0/ranges/0/to", "1000 N*mm"),
        ({"/axes": [{"sample": "sobol", "count": 4,
                     "ranges": [{"path": "pendulums.0.arm", "from": "-30 mm", "to": "3 cm", "scale": "log"}]}]},
         "/axes/0/ranges/0", ["-30 mm", "3 cm"]),
        ({"/base/clutch": {"coefficients": ["0 N*m", "-200 N*m/rad"]}}, "/base/clutch/coefficients",
         ["0 N*m", "-200 N*m/rad"]),
        ({"/base/clutch": {"data": [["0.1 deg", "0 N*m"], ["1 deg", "2000 N*mm"]], "accuracy": "1 N*m",
                           "angles_include_backlash": True}, "/base/pendulums/0/backlash": "3 deg"},
         "/base/clutch/data/1/1", "2000 N*mm"),
    ],
)  # fmt: skip
def test_values_stand_in_messages_as_they_were_written(changes: dict[str, Any], pointer: str, value: object) -> None:
    (problem,) = problems(changes).values()
    assert (problem.where, problem.value) == (pointer, value)
    assert type(problem.value) is type(value)
