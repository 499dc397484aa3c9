"""NetCDF files against the rules of the CF conventions 1.11 that apply to them; numbers of chapters in the tests.

compliance-checker 6.1.0 (`compliance-checker -t cf:1.11`) has neither errors nor warnings for such files.
"""

from __future__ import annotations

import io
import itertools
import re
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
import pytest

from sprag_study.service.client.frames import grid_of
from sprag_study.service.exports.netcdf import cf_name
from sprag_study.worker import models
from tests.service.swept_study import swept_study

if TYPE_CHECKING:
    from tests.service.conftest import Service

Change = Callable[[dict[str, Any]], None]
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
#: A unit as UDUNITS reads it: symbols of the SI with whole powers.
SYMBOL = r"(?:m|kg|s|rad|N|J|W|Pa|Hz)(?:\^-?\d)?"
UNIT = re.compile(rf"1|(?:1/)?{SYMBOL}(?:[*/]{SYMBOL})*")


def grid(spec: dict[str, Any]) -> None:
    """Axes that are not sorted, one of two paths; a derived parameter; settled motions."""
    del spec["base"]["shaft"]["inertia"]
    spec["derive"] = {"shaft.inertia": "2e-3 kg*m^2 * (1 + shaft.load / 1 N*m)"}
    spec["run"] = {"until": "settled", "at_most": "100 periods"}
    spec["axes"] = [
        {"path": "shaft.load", "values": [0.1, 0.3, 0.02]},
        {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": ["3 mm", "1 mm"]},
    ]


def together(spec: dict[str, Any]) -> None:
    """Cases side by side."""
    spec["combine"] = "zip"
    spec["axes"] = [
        {"path": "shaft.load", "values": [0.1, 0.3, 0.02]},
        {"path": "excitation.frequency", "values": [16, 16, 20]},
    ]


def drives(spec: dict[str, Any]) -> None:
    """A batch of drives."""
    spec |= {"tolerances": [{"path": "shaft.inertia", "plus_minus": "5 %"}], "drives": 4}


def single(spec: dict[str, Any]) -> None:
    """One case."""
    spec["axes"] = []


def written(service: Service, spec: dict[str, Any], change: Change | None) -> bytes:
    """The file of a study that has ended."""
    if change is None:
        study_id = swept_study(service)
    else:
        change(spec)
        study_id = service.submit(spec)
        service.fill(study_id)
    return service.http.get(f"/api/v1/studies/{study_id}/results?format=netcdf").content


@pytest.fixture(scope="module")
def contents() -> dict[Change | None, bytes]:
    """The files that have been written, which all tests read."""
    return {}


@pytest.fixture(params=[grid, together, drives, single, None], ids=["grid", "zip", "drives", "single", "sweep"])
def file(request: pytest.FixtureRequest, contents: dict[Change | None, bytes]) -> Iterator[h5py.File]:
    """The file of a study."""
    change: Change | None = request.param
    if change not in contents:
        contents[change] = written(request.getfixturevalue("service"), request.getfixturevalue("spec"), change)
    with h5py.File(io.BytesIO(contents[change])) as opened:
        yield opened


def dimensions(variable: Any) -> list[str]:
    """The names of a variable's dimensions."""
    if variable.attrs.get("CLASS") == b"DIMENSION_SCALE":
        return [variable.name.strip("/")]
    return [scale[0].name.strip("/") for scale in variable.dims]


def test_the_file_says_what_it_is(file: h5py.File) -> None:
    """2.6."""
    assert file.attrs["Conventions"] == "CF-1.11"
    assert file.attrs["title"]
    assert file.attrs["history"]


def test_names(file: h5py.File) -> None:
    """2.3: letters, digits and underscores; no two differ in case only. Attributes too."""
    assert len({name.lower() for name in file}) == len(list(file))
    for name, variable in file.items():
        assert NAME.fullmatch(name), name
        for attribute in variable.attrs:
            assert NAME.fullmatch(attribute.removeprefix("_")), (name, attribute)
        if "sprag_name" in variable.attrs:
            assert cf_name(variable.attrs["sprag_name"]) == name


def test_units_and_meanings(file: h5py.File) -> None:
    """3.1 and 3.2: every number has a unit that UDUNITS reads, and every variable a meaning."""
    for name, variable in file.items():
        assert variable.attrs["long_name"], name
        coded = {"flag_values", "flag_masks"} & set(variable.attrs)
        if not coded:
            assert UNIT.fullmatch(variable.attrs["units"]), (name, variable.attrs["units"])
        assert "axis" not in variable.attrs, "4: only coordinates of space and time have one"
        assert "standard_name" not in variable.attrs, "3.3: the table has no name for these quantities"


def test_flags(file: h5py.File) -> None:
    """3.5: values and masks of the variable's own type, a meaning for each, no value twice."""
    coded = 0
    for variable in file.values():
        for kind in {"flag_values", "flag_masks"} & set(variable.attrs):
            values = np.atleast_1d(variable.attrs[kind])
            assert values.dtype == variable.dtype
            assert len(values) == len(set(values.tolist())) == len(variable.attrs["flag_meanings"].split())
            if kind == "flag_masks":
                assert all(value > 0 and value & (value - 1) == 0 for value in values.tolist())
            coded += 1
    assert coded >= 2


def test_coordinates(file: h5py.File) -> None:
    """5: those of dimensions only rise or only fall and have no missing values; the others are named and fit."""
    scales = {name for name, variable in file.items() if variable.attrs.get("CLASS") == b"DIMENSION_SCALE"}
    for name in scales:
        steps = np.diff(np.asarray(file[name]).astype(float))
        assert (steps > 0).all() or (steps < 0).all(), name
        assert "_FillValue" not in file[name].attrs
    named = set(itertools.chain(*(variable.attrs.get("coordinates", "").split() for variable in file.values())))
    assert named <= set(file)
    for name, variable in file.items():
        for label in variable.attrs.get("coordinates", "").split():
            assert set(dimensions(file[label])) <= set(dimensions(variable)), (name, label)
            assert "_FillValue" not in file[label].attrs or np.isfinite(np.asarray(file[label])).all()
    assert "case" in named | scales


def test_missing_values(file: h5py.File) -> None:
    """2.5.1: the value for missing ones has the type of its variable; here it is NaN, and integers have none."""
    for name, variable in file.items():
        if "_FillValue" in variable.attrs:
            (fill,) = np.atleast_1d(variable.attrs["_FillValue"])
            assert fill.dtype == variable.dtype, name
            assert np.isnan(fill), name
        if variable.shape and name not in {"case"} and variable.attrs.get("CLASS") != b"DIMENSION_SCALE":
            assert variable.chunks is None or (variable.compression, variable.shuffle) == ("gzip", True), name


def test_the_grid_of_the_client_has_the_names_of_all_tables(file: h5py.File) -> None:
    given = {name: variable.attrs.get("sprag_name", name) for name, variable in file.items()}
    with grid_of(file.id.get_file_image()) as opened:
        assert set(map(str, opened.variables)) == set(given.values())
        again = io.BytesIO(opened.to_netcdf(engine="h5netcdf"))
        with h5py.File(again) as written:
            labels = set(map(str, opened.coords)) - set(map(str, opened.dims))
            named = [variable.attrs.get("coordinates", "") for variable in written.values()]
            assert set(" ".join(named).split()) == labels


def test_no_two_names_of_a_model_become_one() -> None:
    for model in models.model_names():
        paths = [entry.path for entry in models.parameter_catalogue(model)]
        names = [info.name for info in models.result_catalogue(model)]
        assert len({cf_name(name) for name in paths}) == len(set(paths))
        assert len({cf_name(name) for name in names}) == len(set(names))
