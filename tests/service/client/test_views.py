"""The client's methods of views are made of their descriptions: names, types, docstrings, and what they send."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal
from typing import Annotated, Any, TypedDict, assert_type

import httpx
import numpy as np
import pandas as pd
import pint
import pytest

from sprag_study.local import LocalStudy
from sprag_study.service.answers.goals import FrontReport
from sprag_study.service.client import ArgumentError, AsyncStudy, Client, Curves, Motion, Study
from sprag_study.service.client.queries import query_of
from sprag_study.service.views import case_questions, study_questions
from sprag_study.service.views.setting import Setting, ViewInfo
from sprag_study.service.views.studies import STUDY_VIEWS
from tests.service.client import view_methods

LOAD, SPEED = "shaft.load", "shaft.speed.mean"
#: Calls that scripts have, and the query of each.
CALLS: list[tuple[str, tuple[Any, ...], dict[str, Any], str]] = [
    ("curves", (LOAD, [SPEED, "efficiency"]), {"by": "b", "at": {"f": "25 Hz"}, "of": {"b": [1.0, 2]}, "number": 0},
     "x=shaft.load&y=shaft.speed.mean&y=efficiency&by=b&at=f=25 Hz&of=b=1.0&of=b=2&number=0"),
    ("curves", (), {"rest": "usual"}, "rest=usual"),
    ("answers", ("0.3 N*m", LOAD), {"by": ("a", "b")}, "point=0.3 N*m&x=shaft.load&by=a&by=b"),
    ("answers", (0.3,), {}, "point=0.3"),
    ("explore", ("c > 0",), {"sort": "-c", "limit": 5, "show": ["c"], "ending": "ok", "regime": "r", "flag": "f"},
     "where=c > 0&ending=ok&regime=r&flag=f&sort=-c&limit=5&show=c"),
    ("map", (LOAD, "b", SPEED), {"at": {"f": 25}, "number": 1}, "x=shaft.load&y=b&z=shaft.speed.mean&at=f=25&number=1"),
    ("sensitivity", (SPEED,), {}, "y=shaft.speed.mean"),
    ("ribbon", (LOAD, SPEED), {"quantiles": [0.05, 0.5]}, "x=shaft.load&y=shaft.speed.mean&quantile=0.05&quantile=0.5"),
    ("yields", (["c > 0", "d < 1"], LOAD), {"worst": 0}, "condition=c > 0&condition=d < 1&x=shaft.load&worst=0"),
    ("calibration", (), {}, ""),
    ("front", (100,), {"exact": True}, "limit=100&exact=true"),
    ("trajectory", (3, 0, "2 periods"), {"points": 50, "start": 1}, "from=0&to=2 periods&points=50&start=1"),
    ("trajectory", (3,), {"begin": 0.5, "end": 1.0}, "from=0.5&to=1.0"),
    ("engagements", (3,), {"start": 2}, "start=2"),
    ("duty", (3,), {"exponent": 5, "start": 2}, "exponent=5&start=2"),
    ("forces", (3,), {"load_rating": "12 kN", "bearing": "roller", "share": 0.5, "points": 50},
     "load_rating=12 kN&bearing=roller&share=0.5&points=50"),
    ("startup", (3,), {"ramp": "0.5 s", "load_ramp": 2, "within": "5 %", "start": 1},
     "ramp=0.5 s&load_ramp=2&within=5 %&start=1"),
    ("strobes", (3,), {}, ""),
    ("branch", (3, LOAD, "0 N*m", 1), {"start": 1}, "along=shaft.load&from=0 N*m&to=1&start=1"),
    ("diagram", (3, LOAD), {"low": 0, "high": 1, "phase": "90 deg", "points": 5, "strobes": 9},
     "along=shaft.load&from=0&to=1&phase=90 deg&points=5&strobes=9"),
    ("section", (3, "90 deg", 50), {}, "phase=90 deg&strobes=50"),
    ("basin", (3, "x", "y"), {"x_range": (0, "1 rad"), "points": 2}, "x=x&y=y&x_from=0&x_to=1 rad&points=2"),
    ("speeds", (3,), {"load": 1.5}, "load=1.5"),
    ("transient", (3, "load-step"), {"load": 1.5, "angle": "1 deg", "torque": 2, "within": 0.1, "revolutions": 9},
     "kind=load-step&load=1.5&angle=1 deg&torque=2&within=0.1&revolutions=9"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "given", "named", "query"), CALLS)
def test_calls_that_scripts_have_are_sent_as_ever(
    name: str, given: tuple[Any, ...], named: dict[str, Any], query: str
) -> None:
    asked: list[httpx.Request] = []

    def answer(request: httpx.Request) -> httpx.Response:
        asked.append(request)
        return httpx.Response(200, json={})

    with Client("http://sprag", transport=httpx.MockTransport(answer)) as client:
        getattr(Study(client, "st_1"), name)(*given, **named)
    (request,) = asked
    wanted = [item.partition("=")[::2] for item in query.split("&")] if query else []
    assert _by_name(request.url.params.multi_items()) == _by_name(wanted)


def _by_name(items: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """The settings by name; those of one name keep their order."""
    return sorted(items, key=lambda item: item[0])


def test_every_view_has_a_method_with_a_docstring_in_both_clients() -> None:
    assert {about.name for about in study_questions.STUDY_VIEWS} == set(STUDY_VIEWS)
    for about in (*study_questions.STUDY_VIEWS, *case_questions.CASE_VIEWS):
        for study in (Study, AsyncStudy):
            method = getattr(study, about.method)
            told = " ".join(str(inspect.getdoc(method)).split())
            assert told.startswith(about.summary.partition(". ")[0]), about.name
            assert method.__annotations__["return"]


class Shape(TypedDict):
    """The answer of a made-up view."""

    answer: float


@dataclass(frozen=True, slots=True)
class Question:
    """What a made-up view is asked."""

    speed: Annotated[str, Setting("the speed, SI or with a unit", alias="at-speed")]
    low_from: Annotated[str | None, Setting("SI or with a unit")] = None
    low_to: Annotated[str | None, Setting("SI or with a unit")] = None
    name: Annotated[list[str] | None, Setting("a name; may be repeated", metavar="NAME")] = None
    kind: Annotated[str | None, Setting("of a picture: which", of_files=True)] = None


def test_a_new_view_has_a_method_without_an_edit() -> None:
    text = view_methods._method(ViewInfo("lambda", Question, "What one asks. And more.", leading=1), Shape, True)
    (method,) = ast.parse(f"class Views:\n{text}").body[0].body  # type: ignore[attr-defined]
    assert method.name == "lambdas"
    assert ast.unparse(method.args) == (
        "self, case: int, speed: Value, *, low_range: Ends | None=None, name: str | Sequence[str]=(), "
        "start: int | None=None"
    )
    assert ast.unparse(method.returns) == "Shape"
    said = ast.get_docstring(method)
    assert said is not None
    assert said.startswith("What one asks.\n\nAnd more.\n\nParameters\n")
    assert "speed : float or str\n    The speed, SI or with a unit." in said
    assert "name : str or sequence of str, optional\n    A name." in said
    assert "'at-speed': speed, 'low_from': None if low_range is None else low_range[0]" in ast.unparse(method)
    assert "'/lambda'" in ast.unparse(method)


def test_settings_are_what_programs_have() -> None:
    units = pint.UnitRegistry()
    assert query_of(
        {
            "a": None, "b": False, "c": [], "d": np.float64(0.5), "e": np.array([1, 2]), "f": True, "g": Decimal("0.1"),
            "h": {"p": units.Quantity(25, "Hz"), "q": [1, 2]}, "i": pd.Index(["x", "y"]), "j": {"k": 1}.keys(),
            "k": (text for text in "lm"), "n": "",
        }
    ) == [
        ("d", "0.5"), ("e", "1"), ("e", "2"), ("f", "true"), ("g", "0.1"), ("h", "p=25 Hz"), ("h", "q=1"), ("h", "q=2"),
        ("i", "x"), ("i", "y"), ("j", "k"), ("k", "l"), ("k", "m"), ("n", ""),
    ]  # fmt: skip
    with pytest.raises(ArgumentError, match="y"):
        query_of({"y": object()})


def typed(study: Study) -> None:
    """What mypy, which checks the tests too, knows of a study: an unused ignore is an error."""
    assert_type(study.curves(LOAD, [SPEED], at={"f": "25 Hz"}, of={"b": [1.0]}), Curves)
    assert_type(study.front(3), FrontReport)
    assert_type(study.trajectory(3, 0, "2 periods"), Motion)
    study.curves(1)  # type: ignore[arg-type]
    study.nothing()  # type: ignore[attr-defined]
    LocalStudy.nothing  # type: ignore[attr-defined]  # noqa: B018
