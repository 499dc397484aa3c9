"""Cases that a script has as a table: frames, grids, columns, rows, with numbers of any library and their units."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pandas as pd
import pint
import polars as pl
import pytest
import xarray as xr

import sprag_study as sprag
from sprag_study.service.client import ArgumentError
from sprag_study.service.client.case_tables import points_of
from sprag_study.service.client.queries import spec_of
from sprag_study.service.plain_data import plain
from tests.sprag_study.test_library import SPEC

LOAD, FREQUENCY = "shaft.load", "excitation.frequency"
LOADS, FREQUENCIES = np.array([0.0, 0.25]), np.array([20.0, 25.0])
UNIT = pint.UnitRegistry()
PLAIN = f"{LOAD},{FREQUENCY}\n0.0,20.0\n0.25,25.0\n"
IN_RPM = f"{LOAD},{FREQUENCY} [rpm]\n0.0,20.0\n0.25,25.0\n"


def with_unit(frame: pd.DataFrame) -> pd.DataFrame:
    """A frame whose frequencies are in rpm."""
    frame.attrs["units"] = {LOAD: "1", FREQUENCY: "rpm"}
    return frame


@pytest.mark.parametrize(
    ("cases", "text"),
    [
        (pd.DataFrame({LOAD: LOADS, FREQUENCY: FREQUENCIES}), PLAIN),
        (with_unit(pd.DataFrame({LOAD: LOADS, FREQUENCY: FREQUENCIES})), IN_RPM),
        (pl.DataFrame({LOAD: LOADS, FREQUENCY: FREQUENCIES}), PLAIN),
        ({LOAD: LOADS, FREQUENCY: FREQUENCIES}, PLAIN),
        ([{LOAD: 0.0, FREQUENCY: 20.0}, {FREQUENCY: np.float64(25), LOAD: 0.25}], PLAIN),
        (xr.Dataset({LOAD: ("case", LOADS), FREQUENCY: ("case", FREQUENCIES)}), PLAIN),
        (xr.Dataset({LOAD: ("case", LOADS), FREQUENCY: ("case", FREQUENCIES, {"units": "rpm"})}), IN_RPM),
        (xr.Dataset({LOAD: (FREQUENCY, LOADS)}, {FREQUENCY: FREQUENCIES}),
         f"{FREQUENCY},{LOAD}\n20.0,0.0\n25.0,0.25\n"),
        ({LOAD: LOADS * UNIT("N*m"), FREQUENCY: "25 Hz"},
         f"{LOAD},{FREQUENCY}\n0.0 m * N,25 Hz\n0.25 m * N,25 Hz\n"),
    ],
)  # fmt: skip
def test_tables_of_every_library_are_cases(cases: Any, text: str) -> None:
    before = copy.deepcopy(cases)
    assert points_of(cases, "cases") == text
    assert before.equals(cases) if hasattr(cases, "equals") else repr(before) == repr(cases)


@pytest.mark.parametrize(
    "measured",
    [
        pd.DataFrame({LOAD: LOADS, FREQUENCY: [None, 25.5]}),
        pd.DataFrame({LOAD: LOADS, FREQUENCY: [None, 25.5]}).convert_dtypes(),
        pd.DataFrame({LOAD: LOADS, FREQUENCY: pd.array([pd.NA, 25.5], dtype="Float64")}),
        {LOAD: LOADS, FREQUENCY: [pd.NA, 25.5]},
    ],
    ids=["NaN", "converted", "NA of a column", "NA of a list"],
)
def test_a_cell_without_a_value_was_not_measured(measured: Any) -> None:
    assert points_of(measured, "measured", gaps=True) == f"{LOAD},{FREQUENCY}\n0.0,\n0.25,25.5\n"


@pytest.mark.parametrize(
    ("cases", "message"),
    [
        (pd.DataFrame({LOAD: [0.1, None]}), r"cases\['shaft.load'\].*a number, or a text with a unit, in every row"),
        ([{LOAD: 0.1}, {FREQUENCY: 2}], r"cases\['shaft.load'\].*in every row"),
        ({LOAD: [0.1, 0.2], FREQUENCY: [1, 2, 3]}, "columns of one length"),
        ({LOAD: [[0.1], [0.2]]}, "in every row"),
        (np.zeros((2, 2)), "a table with a column for each parameter"),
        ("shaft.load\n1", "a table with a column for each parameter"),
    ],
)
def test_what_is_no_table_is_named(cases: Any, message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        points_of(cases, "cases")


def test_cases_take_the_place_of_what_varies_in_a_spec() -> None:
    spec = spec_of("one_pendulum", {LOAD: LOADS})
    assert spec["axes"] == [{"points": f"{LOAD}\n0.0\n0.25\n"}]
    assert "combine" not in spec
    assert spec["base"] == sprag.preset("one_pendulum")["base"]


def test_arrays_of_xarray_are_values_with_their_unit() -> None:
    array = xr.DataArray([1.0, 2.0], dims="case", attrs={"units": "N*m"})
    assert plain({"values": array, "one": array[0]}) == ({"values": ["1.0 N*m", "2.0 N*m"], "one": "1.0 N*m"}, [])
    assert plain(xr.DataArray([1.0])) == ([1.0], [])
    assert plain(xr.DataArray([1.0] * UNIT("N*m"), dims="case")) == (["1.0 m * N"], [])


def test_a_run_takes_the_cases_of_a_frame() -> None:
    frame = pd.DataFrame({LOAD: [0.0, 0.1], FREQUENCY: [1200.0, 1500.0]})
    frame.attrs["units"] = {FREQUENCY: "rpm"}
    with sprag.run(SPEC, cases=frame, processes=0) as study:
        table = study.table()
    assert table[LOAD].tolist() == [0.0, 0.1]
    assert table[FREQUENCY].tolist() == pytest.approx([20.0, 25.0])
