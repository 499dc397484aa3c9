"""Whether a search has converged, as its headline says it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from sprag_study.service.languages import language
from sprag_study.service.reading.quantities import Units
from sprag_study.service.reading.reader import Reading
from sprag_study.service.results.headlines.search import converged, unimproved
from tests.worker.planning.searching import plan_of

READING = Reading("vibration-drive", Units())


def _search(bests: list[float | None], end: dict[str, Any] | None = None, **fields: Any) -> Any:
    """A search whose best values were these after each generation, and at its end."""
    summaries = [{"kind": "goal", "phase": "search", "generation": 0, "best": [None]}]
    summaries += [{"phase": "search", "generation": number, "best": [best]} for number, best in enumerate(bests, 1)]
    summaries.append({**summaries[-1], "phase": "ended", **(end or {})})
    rounds = [SimpleNamespace(round=number, summary=summary) for number, summary in enumerate(summaries)]
    return SimpleNamespace(rounds=rounds, plan=plan_of(2, ["f"], **({"generations": len(bests)} | fields)))


@pytest.mark.parametrize(
    ("bests", "count"),
    [
        ([3.0, 2.0, 1.0], 0),
        ([3.0, 2.0, 1.0, 1.0, 1.0], 2),
        ([3.0, 1.0, 1.0, 1.002], 0),
        ([3.0, 1.0008, 1.0004, 1.0], 2),
        ([None, None, 5.0, 5.0], 1),
        ([None, None], 0),
        ([-2.0, -2.0, -2.0], 2),
    ],
)
def test_the_last_generations_that_gained_less_than_a_thousandth(bests: list[float | None], count: int) -> None:
    assert unimproved(_search(bests)) == count


def test_what_polish_and_finish_gain_is_not_the_search_s() -> None:
    search = _search([3.0, 2.0, 2.0, 2.0], {"best": [1.0], "finish": 12})
    assert unimproved(search) == 2


def _said(search: Any, *, over: bool = True) -> str:
    return READING.say(converged(search, over=over))


def test_a_search_says_whether_more_generations_would_help() -> None:
    assert _said(_search([3.0, 2.0, 1.0, 1.0, 1.0, 1.0])) == (
        "The search has converged: the last 3 generations bettered the goal by less than 0.1 %."
    )
    still = _search([3.0, 2.5, 2.0, 1.5])
    assert _said(still) == (
        "The search has not converged: its best value has not stood still long enough, and more generations may better "
        "it."
    )
    assert _said(still, over=False) == ""
    assert _said(_search([3.0, 2.5, 2.0, 1.5], {"finish": 20, "best": [1.4]})) == (
        "The search has not converged: its best design was brought to the optimum beside it, and more generations may "
        "come to another one."
    )


def test_generations_that_stood_still_far_from_the_optimum_have_not_converged() -> None:
    """The finish betters by 25 % what six generations of few designs came to."""
    search = _search([3.0, 2.0, 2.0, 2.0, 2.0, 2.0], {"finish": 20, "best": [1.5]})
    assert _said(search).startswith("The search has not converged: its best design was brought")
    little = _search([3.0, 2.0, 2.0, 2.0, 2.0, 2.0], {"finish": 20, "best": [1.999]})
    assert _said(little).startswith("The search has converged: the last 4 generations")


def test_a_search_that_ended_by_itself_says_after_how_many_generations() -> None:
    search = _search([3.0, 2.0, 1.0, 0.9995], generations=60, least_gain=2e-3)
    expected = (
        "The search has converged after 4 of at most 60 generations: starting anew bettered the goal by at most 0.2 %."
    )
    assert _said(search) == expected
    with language("uk"):
        assert "4" in _said(search)
        assert _said(search) != expected
    cancelled = _search([3.0, 2.0, 1.0, 0.9995], {"phase": "search"}, generations=60, least_gain=2e-3)
    assert _said(cancelled).startswith("The search has not converged")
