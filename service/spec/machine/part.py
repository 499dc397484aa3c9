"""What depends on the model in a spec, and the reading of machines that are plain numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from sprag_study.service.languages import N_
from sprag_study.service.spec.described import Field, Record
from sprag_study.service.spec.machine.machine import Machine
from sprag_study.service.spec.run import refuse_run

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from sprag_study.service.spec.kinds.draft import Draft
    from sprag_study.service.spec.node import Node
    from sprag_study.service.spec.report import Report
    from sprag_study.worker.models import Parameter
    from sprag_study.worker.study import Axis, Combine, Study

    Axes = tuple[Axis, ...]


#: A windup limit that is none: as a choice of a clutch, and as pages print it.
NO_LIMIT: Final = N_("none")


class Choice(NamedTuple):
    """One choice: its path in the base, the chosen value, and its meaning."""

    path: str
    text: str
    meaning: str


_NO_RUN: Final = Record({}, "nothing: this model has no run")


def _no_run(run: Node, *_: object) -> dict[str, Any]:
    return refuse_run(run)


def _nothing(*_: object) -> None:
    """Check nothing, warn of nothing."""


def _no_choices(*_: object) -> tuple[Choice, ...]:
    return ()


@dataclass(frozen=True, slots=True)
class SpecPart:
    """The part of one model; every function records faults in the report that it is given.

    Attributes
    ----------
    read_base : reads `base`
    check_base : checks a machine as a whole that could be read without faults
    base, run : their descriptions
    read_run : reads `run` as stored in a study, for a machine with its axes (None where they could not be read) and
        their combination
    check : checks what depends on the machine together with what varies, when all of the spec has been read
    warn : warns of what is allowed but implausible
    choices : the non-numeric fields of a study's machine; also takes the user's spec
    """

    read_base: Callable[[Node], Machine]
    base: Callable[[], Field]
    check_base: Callable[[Report, Machine], None] = _nothing
    read_run: Callable[[Node, Axes | None, Combine], dict[str, Any]] = _no_run
    run: Field = _NO_RUN
    check: Callable[[Draft], None] = _nothing
    warn: Callable[[Report, Study], None] = _nothing
    choices: Callable[[Study, Mapping[str, Any]], Iterable[Choice]] = _no_choices


def read_plain(base: Node, catalogue: tuple[Parameter, ...]) -> Machine:
    """Read the machine of a model that is fully described by ``catalogue``: plain numbers, no lists, no choices."""
    machine = Machine(parameters={entry.path: entry for entry in catalogue})
    if _check_fields(base, "", machine):
        read_numbers(base, machine)
    return machine


def read_numbers(base: Node, machine: Machine) -> None:
    """Read the numbers of the machine's parameters into its values; faults are recorded."""
    for path, entry in machine.parameters.items():
        node = base.below(path)
        number = node.number_or_default(entry)
        # An open end of a range is not a number that could be stored.
        if number is not None and (node.given or entry.accepts(number)):
            machine.values[path] = number


def _check_fields(node: Node, prefix: str, machine: Machine) -> bool:
    """Whether a part of the base is an object; what parameters are not in, in it and below it, is recorded."""
    rests = (path.removeprefix(prefix) for path in machine.parameters if path.startswith(prefix))
    names = list(dict.fromkeys(rest.split(".")[0] for rest in rests))
    if not node.has(names):
        return False
    for name in names:
        if f"{prefix}{name}" not in machine.parameters and name in node:
            _check_fields(node[name], f"{prefix}{name}.", machine)
    return True
