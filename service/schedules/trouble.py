"""Flags of cases that need attention: which of them count as trouble of a run is up to its schedule."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.sentences import Sentence
from sprag_study.service.languages import N_
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.worker import models

if TYPE_CHECKING:
    from sprag_study.service.spec.node import Node


def usual_flags(model: str) -> tuple[str, ...]:
    """The flags that count where a schedule names none: those of motions that had not settled."""
    known = models.model_of(model)
    return tuple(name for name in known.flags if name in known.unsettled)


def read_trouble_flags(node: Node, model: str | None) -> tuple[str, ...] | None:
    """The flags that a schedule names, each of them one of ``model``; None: `usual_flags`. Faults are recorded.

    With ``model`` None, because the spec is wrong, names are not compared.
    """
    if node.value is None:
        return None
    known = () if model is None else tuple(models.flags_of(model))
    names = ", ".join(known)
    if not isinstance(node.value, list):
        allowed = Sentence("a list of {names}", names=names) if known else Sentence("an empty list")
        node.refuse("wrong-type", "must be a list of flags", allowed=allowed)
        return None
    allowed_name, flags = names if known else N_("no flag"), list[str]()
    for item in node.parts():
        flag = item.value
        if node.report.full:
            break
        if not isinstance(flag, str):
            item.refuse("wrong-type", "must be the name of a flag", allowed=allowed_name)
        elif flag in flags:
            item.refuse("repeated", "is given twice", allowed=allowed_name)
        elif model is not None and flag not in known:
            message = Sentence("is not a flag of the model {model}{hint}", model=model, hint=did_you_mean(flag, known))
            if not known:
                message = Sentence("is not a flag of the model {model}, which has none", model=model)
            item.refuse("unknown-name", message, allowed=allowed_name)
        else:
            flags.append(flag)
    return tuple(flags)
