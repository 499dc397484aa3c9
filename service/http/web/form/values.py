"""The fields of a form as a browser sends them."""

from __future__ import annotations

from typing import Annotated, Final
from urllib.parse import parse_qsl

from fastapi import Depends, Request

from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.web.form.entries import Values
from sprag_study.service.languages import _

Pairs = list[tuple[str, str]]
#: Names that fields of older drafts have, and what they are called today.
OLD_NAMES: Final = {"drive_is": "/base/drive", "clutches": "/base/clutches"}
_FORM_TYPE: Final = "application/x-www-form-urlencoded"
#: Fields of a form, at most.
_MOST_FIELDS: Final = 2000


async def read_pairs(request: Request) -> Pairs:
    """Read the fields, repeated ones too. Raises ApiError."""
    if request.headers.get("content-type", "").partition(";")[0].strip().lower() != _FORM_TYPE:
        raise ApiError("unsupported-media-type", f"A form is sent as {_FORM_TYPE}.")
    try:
        text = (await request.body()).decode("utf-8")
        pairs = parse_qsl(text, keep_blank_values=True, max_num_fields=_MOST_FIELDS)
    except ValueError as error:
        raise ApiError("bad-request", "The form cannot be read.") from error
    return [(OLD_NAMES.get(name, name), text) for name, text in pairs]


async def read_form(request: Request) -> Values:
    """Read the fields; the last value of a repeated name counts. Raises ApiError."""
    return dict(await read_pairs(request))


def changed_meanwhile() -> str:
    """What a form says whose object somebody else changed after the page showed the form."""
    return _(
        "Somebody changed this after this page showed the form, so nothing was saved. Look at the present values in "
        "another window. If you save again, the values here replace them."
    )


RepeatedForm = Annotated[Pairs, Depends(read_pairs)]
Form = Annotated[Values, Depends(read_form)]
