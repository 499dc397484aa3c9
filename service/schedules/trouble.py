"""Flags of cases that need attention: which of them count as trouble of a run is up to its schedule."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.sentences import Sentence
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.spec.report import Report
from sprag_study.worker import models

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

_FIELD = "/trouble_flags"


def usual_flags(model: str) -> tuple[str, ...]:
    """The flags that count where a schedule names none: those of motions that had not settled."""
    known = models.model_of(model)
    return tuple(name for name in known.flags if name in known.unsettled)


def read_trouble_flags(report: Report, found: Mapping[str, Any], model: str | None) -> tuple[str, ...] | None:
    """The flags that the fields ``found`` name, each of them one of ``model``; None: `usual_flags`. Faults are noted.

    With ``model`` None, because the spec is wrong, names are not compared.
    """
    value = found.get("trouble_flags")
    if value is None:
        return None
    known = () if model is None else tuple(models.flags_of(model))
    names = ", ".join(known)
    if not isinstance(value, list):
        allowed = Sentence("a list of {names}", names=names) if known else Sentence("an empty list")
        report.fault(_FIELD, "wrong-type", "must be a list of flags", value, allowed=allowed)
        return None
    seen: set[str] = set()
    for number, flag in enumerate(value):
        where = f"{_FIELD}/{number}"
        if report.full:
            break
        if not isinstance(flag, str):
            report.fault(where, "wrong-type", "must be the name of a flag", flag, allowed=names if known else "no flag")
        elif flag in seen:
            report.fault(where, "repeated", "is given twice", flag, allowed=names if known else "no flag")
        elif model is not None and flag not in known:
            hint = did_you_mean(flag, known)
            message = Sentence("is not a flag of the model {model}{hint}", model=model, hint=hint)
            if not known:
                message = Sentence("is not a flag of the model {model}, which has none", model=model)
            report.fault(where, "unknown-name", message, flag, allowed=names if known else "no flag")
        else:
            seen.add(flag)
    return tuple(flag for flag in value if isinstance(flag, str))
