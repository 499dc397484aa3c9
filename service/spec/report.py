"""Collects the faults of a spec while it is read."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from sprag_study.sentences import Place, Sentence, WarningText, plural
from sprag_study.service.faults import Code, Fault, FaultError, WarningCode
from sprag_study.service.reading.texts import did_you_mean, shorten, shorten_text
from sprag_study.worker.limits import MAX_PROBLEMS

if TYPE_CHECKING:
    from sprag_study.service.spec.machine.machine import Machine
    from sprag_study.worker.models import ResultInfo


class SpecError(FaultError):
    """A spec that cannot be run, with all its faults. ``str()`` gives one line per fault."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        faults = tuple(faults)
        super().__init__("invalid-spec", "\n".join(map(str, faults)), faults)


class Report:
    """Collects faults and warnings while ``source``, plain data that the user wrote, is read."""

    def __init__(self, source: object = None, told: Sequence[str] = ()) -> None:
        self._source = source
        #: Names that goals may have beside the results of the study: numbers that somebody else computes.
        self.told = told
        self.faults: list[Fault] = []
        #: Number of faults, including those beyond the limit.
        self.found = 0
        self.warnings: list[WarningText] = []
        #: What further parts of the spec refer to, as soon as they are known: the machine, the results of its study.
        self.machine: Machine | None = None
        self.results: Sequence[ResultInfo] = ()
        #: Names of the results that the study would have if its run had `loads`.
        self.further: Collection[str] = ()

    def fault(
        self,
        pointer: str,
        code: Code,
        message: str,
        value: object = None,
        *,
        allowed: str | None = None,
        unit: str | None = None,
    ) -> None:
        """Record a fault, unless there are `MAX_PROBLEMS` already; numbers appear as the user wrote them.

        ``message`` and ``allowed`` are sentences, texts of the catalogue, or names that are the same in all languages.
        """
        self.found += 1
        if not self.full:
            shown = _as_written(value, _at(self._source, pointer))
            self.faults.append(Fault(pointer, code, message, shorten(shown), allowed, unit))

    def written(self, pointer: str) -> object:
        """What the user wrote at a JSON Pointer; None where there is nothing."""
        return _at(self._source, pointer)

    def adopt(self, other: Report) -> None:
        """Record the faults of another report, without its warnings."""
        self.found += other.found
        self.faults += other.faults[: max(MAX_PROBLEMS - len(self.faults), 0)]

    @property
    def full(self) -> bool:
        """Whether the limit of faults is reached, so that further checks are useless."""
        return len(self.faults) >= MAX_PROBLEMS

    def warn(self, code: WarningCode, place: Place | str, text: str) -> None:
        """Record a warning about something allowed but probably unintended; each sentence only once.

        ``place`` is a JSON Pointer, or a place with what it is about.
        """
        self.adopt_warning(place, WarningText(text, code))

    def adopt_warning(self, place: Place | str, warning: WarningText) -> None:
        """Record a warning of the engine with its place."""
        placed = warning.at(Place(place) if isinstance(place, str) else place)
        if placed not in self.warnings:
            self.warnings.append(placed)

    def unknown_fields(self, pointer: str, found: Mapping[str, object], known: Iterable[str]) -> None:
        """Record a fault for every key of ``found`` that is not ``known``, with the nearest known one."""
        known = tuple(known)
        for key in found:
            if key not in known and not self.full:
                self.fault(
                    join(pointer, key),
                    "unknown-field",
                    Sentence("unknown field{hint}", hint=did_you_mean(key, known)),
                    found[key],
                    allowed=Sentence("the fields {names}", names=", ".join(known)),
                )

    def raise_if_any(self) -> None:
        """Raise `SpecError` with the faults recorded so far, if any."""
        if self.faults:
            raise self.error()

    def error(self) -> SpecError:
        """The error with all faults recorded so far."""
        message = plural("only the first fault is listed", "only the first {count} faults are listed", MAX_PROBLEMS)
        return SpecError([*self.faults, *([Fault("", "too-many-faults", message)] if self.full else [])])


def _at(source: object, pointer: str) -> object:
    """The value at a JSON Pointer; None where there is none."""
    for part in pointer.split("/")[1:]:
        key = part.replace("~1", "/").replace("~0", "~")
        if isinstance(source, Mapping):
            source = source.get(key)
        elif isinstance(source, list) and key.isdecimal() and int(key) < len(source):
            source = source[int(key)]
        else:
            return None
    return source


def _as_written(value: object, written: object) -> object:
    """``written`` instead of the SI number or numbers derived from it."""
    if isinstance(value, list | tuple) and isinstance(written, list) and 0 < len(value) == len(written):
        pairs = list(zip(value, written, strict=True))
        return [_as_written(*pair) for pair in pairs]
    numeric = isinstance(value, float | int) and not isinstance(value, bool)
    return written if numeric and isinstance(written, str | float | int) and not isinstance(written, bool) else value


def join(pointer: str, *keys: str | int) -> str:
    """``pointer`` extended by object keys and list positions, escaped as in RFC 6901; long keys are truncated."""
    parts = (shorten_text(str(key)).replace("~", "~0").replace("/", "~1") for key in keys)
    return pointer + "".join(f"/{part}" for part in parts)
