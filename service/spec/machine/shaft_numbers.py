"""The numbers of a machine shaft by where they are in a spec."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sprag_study.sentences import Sentence
from sprag_study.service.spec.node import Node
from sprag_study.worker import models
from sprag_study.worker.models import Parameter, machine_shaft


def numbers_under(prefix: str) -> dict[str, Parameter]:
    """The numbers directly under ``prefix`` (with its last dot) in the catalogue, by their names."""
    entries = {entry.path: entry for entry in models.parameter_catalogue(models.MACHINE_SHAFT)}
    below = {path.removeprefix(prefix): entry for path, entry in entries.items() if path.startswith(prefix)}
    return {name: entry for name, entry in below.items() if "." not in name}


def numbers_of(structure: Mapping[str, Any], prefix: str) -> list[str]:
    """The numbers under ``prefix`` of a machine of this structure, by their names."""
    return [path.removeprefix(prefix) for path in machine_shaft.parameters_of(structure) if path.startswith(prefix)]


def refuse_foreign(node: Node, own: Sequence[str], what: Sentence) -> None:
    """Record a fault of each field that ``what`` does not have."""
    for name in node.value:
        if name not in own:
            message = Sentence("is not a field of {what}", what=what)
            node[name].refuse("unknown-field", message, allowed=", ".join(own))
