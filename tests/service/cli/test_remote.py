"""What commands make of the service's refusals: options by their names on the command line."""

from __future__ import annotations

from sprag_study.service.cli.remote import refusal
from sprag_study.service.client import RefusedError
from sprag_study.service.login import Access


def test_parameters_are_called_as_the_options_are() -> None:
    item = {
        "parameter": "by",
        "message": "the axis is already taken by x=shaft.load; name it in by=, or give at=shaft.load=VALUE",
    }
    title = "The selection is not possible"
    failure = refusal(RefusedError(422, {"title": title, "detail": "by: ...", "errors": [item]}))
    assert failure.detail == title
    assert str(failure.faults[0]) == (
        "--by: the axis is already taken by --x shaft.load; name it in --by, or give --at shaft.load=VALUE"
    )
    paged = refusal(RefusedError(422, {"errors": [{"parameter": "page_size", "message": "no"}]}))
    assert paged.faults[0].where == "--page-size"


def test_fields_of_a_spec_keep_their_pointers_and_messages() -> None:
    item = {"pointer": "/base/shaft/load", "code": "not-finite", "message": "must be finite"}
    (problem,) = refusal(RefusedError(422, {"title": "no", "errors": [item]})).faults
    assert (problem.where, problem.code, problem.message) == ("/base/shaft/load", "not-finite", "must be finite")


def test_a_missing_token_is_asked_for_by_its_variable() -> None:
    access = Access("http://a", None, "", takes_variable=True)
    failure = refusal(RefusedError(401, {"detail": "This request carries no valid token."}), access)
    assert failure.exit_code == 3
    assert "--token" in failure.detail
    assert "SPRAG_TOKEN" in failure.detail
