"""Values of numpy, decimal, pandas and pint in specs, as the library and the client take them."""

from __future__ import annotations

import json
import subprocess
import sys
from decimal import Decimal
from enum import Enum, IntEnum
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import httpx
import numpy as np
import pandas as pd
import pint
import pytest

import sprag_study as sprag
from sprag_study.service.plain_data import plain
from sprag_study.service.reading.units import parse_quantity
from sprag_study.service.spec.report import SpecError
from tests.sprag_study.test_library import SPEC

if TYPE_CHECKING:
    from collections.abc import Callable

UNITS: Any = pint.UnitRegistry()


class Name(str, Enum):  # noqa: UP042
    X = "x"


class Count(IntEnum):
    TWO = 2


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (np.float64(0.1), 0.1),
        (np.float32(0.5), 0.5),
        (np.longdouble(0.25), 0.25),
        (np.int64(3), 3),
        (np.uint8(3), 3),
        (np.bool_(True), True),
        (np.str_("2 mm"), "2 mm"),
        (np.array([1, 2]), [1, 2]),
        (np.array([[1.0, 2.5], [3.0, 4.0]]), [[1.0, 2.5], [3.0, 4.0]]),
        (np.array(7), 7),
        (np.array([np.int32(1), "2 mm", None], dtype=object), [1, "2 mm", None]),
        (Decimal("0.1"), 0.1),
        (Decimal("1E3"), 1000),
        (Fraction(1, 3), 1.0 / 3.0),
        (Fraction(4, 2), 2),
        (pd.Series([1, 2.5]), [1.0, 2.5]),
        (pd.Series([1, 2], index=["unit", "units"]), [1, 2]),
        (pd.Index(["1 mm", "2 mm"]), ["1 mm", "2 mm"]),
        (pd.array([1, 2], dtype="Int64"), [1, 2]),
        (range(3), [0, 1, 2]),
        ((0.1, np.float64(0.2)), [0.1, 0.2]),
        (Name.X, "x"),
        (Count.TWO, 2),
        (UNITS.Quantity(3, "dimensionless"), 3),
    ],
)
def test_numbers_and_columns_are_plain(value: object, expected: object) -> None:
    made, faults = plain({"a": value})
    assert (made, faults) == ({"a": expected}, [])
    assert json.dumps(made) == json.dumps({"a": expected})


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("2 mm", "m"), ("1500 rpm", "Hz"), ("1500 rpm", "rad/s"), ("25 Hz", "Hz"), ("0.3 degree", "rad"),
        ("9 N/mm", "N/m"), ("3 N*mm", "N*m"), ("0.01 N*m*s/rad", "N*m*s/rad"), ("1e-3 kg*m**2", "kg*m^2"),
        ("9.81 m/s**2", "m/s^2"), ("6 bar", "Pa"), ("50 cm**2", "m^2"), ("5 µm", "m"), ("2 inch", "m"),
    ],
)  # fmt: skip
def test_a_quantity_of_pint_is_a_text_with_its_unit(text: str, unit: str) -> None:
    quantity = UNITS.Quantity(text)
    (one, many), faults = plain([quantity, quantity * np.array([1.0, 2.0])])
    assert faults == []
    assert parse_quantity(one, unit) == parse_quantity(text.replace("degree", "deg").replace("inch", "in"), unit)
    assert [parse_quantity(item, unit) for item in many] == pytest.approx(
        [parse_quantity(one, unit), 2 * parse_quantity(one, unit)], rel=1e-15
    )


def of_itself() -> list[Any]:
    data: list[Any] = []
    data.append(data)
    return data


@pytest.mark.parametrize(
    ("value", "pointer", "code"),
    [
        (float("nan"), "/a~1b", "not-finite"),
        (np.float32("inf"), "/a~1b", "not-finite"),
        (Decimal("NaN"), "/a~1b", "not-finite"),
        (np.array([1.0, np.nan]), "/a~1b/1", "not-finite"),
        (pd.Series([1.0, None]), "/a~1b/1", "not-finite"),
        (UNITS.Quantity(float("nan"), "mm"), "/a~1b", "not-finite"),
        (Decimal("1E1000000"), "/a~1b", "out-of-range"),
        (Decimal("1E-1000000"), "/a~1b", "out-of-range"),
        (Fraction(10**400, 3), "/a~1b", "out-of-range"),
        (pd.array([1, None], dtype="Int64"), "/a~1b/1", "wrong-type"),
        (pd.Timestamp(0), "/a~1b", "wrong-type"),
        (pd.DataFrame({"a": [1]}), "/a~1b", "wrong-type"),
        (np.array([object()]), "/a~1b/0", "wrong-type"),
        (np.complex128(1), "/a~1b", "wrong-type"),
        ({1, 2}, "/a~1b", "wrong-type"),
        (b"1", "/a~1b", "wrong-type"),
        ({None: 1}, "/a~1b", "wrong-type"),
    ],
)
def test_what_has_no_form_in_json_is_refused_with_its_place(value: object, pointer: str, code: str) -> None:
    _, faults = plain({"a/b": value})
    assert [(fault.where, fault.code) for fault in faults] == [(pointer, code)]


def test_arrays_with_units_of_other_libraries_are_refused() -> None:
    class WithUnits(np.ndarray):  # as astropy and unyt have them
        unit = "mm"

    (fault,) = plain([np.array([1.0, 2.0]).view(WithUnits)])[1]
    assert (fault.where, fault.code) == ("/0", "wrong-type")


def test_data_that_contain_themselves_are_refused() -> None:
    (fault,) = plain(of_itself())[1]
    assert fault.code == "too-long"


def with_values(**others: Any) -> dict[str, Any]:
    """The sample of the library with values as programs have them."""
    base = SPEC["base"]
    excitation = base["excitation"] | {"frequency": UNITS.Quantity("1200 rpm"), "amplitude_x": np.float64(0.002)}
    pendulum = base["pendulums"][0] | {"mass": Decimal("0.5"), "inertia": np.float64(1e-3)}
    clutch = {"coefficients": np.array([0, 200, 0, 20000])}
    axes = [{"path": "shaft.load", "values": pd.Series([0.0, 0.1, 0.2]), **others}]
    return SPEC | {
        "sprag": np.int64(1), "axes": axes,
        "base": base | {"excitation": excitation, "pendulums": (pendulum,), "clutch": clutch},
    }  # fmt: skip


def test_a_study_run_here_takes_them() -> None:
    expected = sprag.run(SPEC, processes=0).table()
    pd.testing.assert_frame_equal(sprag.run(with_values(), processes=0).table(), expected)
    with pytest.raises(SpecError) as caught:
        sprag.run(with_values(values=np.array([0.1, np.nan])), processes=0)
    assert [(fault.where, fault.code) for fault in caught.value.faults] == [("/axes/0/values/1", "not-finite")]


DOORS: dict[str, Callable[[sprag.Client, Any], object]] = {
    "submit": lambda client, value: client.submit({"a": value}),
    "preview": lambda client, value: client.preview({"a": value}),
    "create_schedule": lambda client, value: client.create_schedule({"a": value}, cron="0 1 * * *"),
    "put_components": lambda client, value: client.put_components([{"a": value}]),
    "fit_clutch": lambda client, value: client.fit_clutch([(0, 0), (1, 1)], accuracy=1, a=value),
    "extend": lambda client, value: sprag.Study(client, "st_1").extend([{"a": value}]),
}


@pytest.mark.parametrize("door", DOORS)
def test_every_body_of_the_client_takes_them(door: str) -> None:
    bodies: list[str] = []

    def answer(request: httpx.Request) -> httpx.Response:
        bodies.append(request.content.decode())
        return httpx.Response(200, json={"id": "st_1", "components": []})

    value = {"n": np.int64(3), "x": np.array([np.float32(0.5), 2.0]), "d": Decimal("0.25"), "q": UNITS.Quantity("2 mm")}
    with sprag.Client("http://127.0.0.1:9", transport=httpx.MockTransport(answer)) as client:
        DOORS[door](client, value)
        assert len(bodies) == 1
        assert '"a":{"n":3,"x":[0.5,2.0],"d":0.25,"q":"2 mm"}' in bodies[0]
        with pytest.raises(sprag.RefusedError) as caught:
            DOORS[door](client, {"b": [object()]})
        assert caught.value.status == 422
        assert [(fault.where or "")[-6:] for fault in caught.value.faults] == ["/a/b/0"]
    assert len(bodies) == 1


def test_a_client_needs_none_of_these_libraries() -> None:
    program = (
        "import sys; sys.modules.update(dict.fromkeys(('numpy', 'pandas', 'pint')))\n"
        "from decimal import Decimal; from sprag_study.service.client.wire import plain_body\n"
        "assert plain_body({'a': Decimal('0.5'), 'b': (1, 2)}) == {'a': 0.5, 'b': [1, 2]}\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
