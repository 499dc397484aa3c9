"""Faults of input: their place, the given value, what is allowed, and a stable code.

Wording may change; programs and tests rely on the codes, which ``docs/faults.md`` explains.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypedDict, TypeVar

from sprag_study.sentences import Sentence
from sprag_study.worker.errors import SpragError

if TYPE_CHECKING:
    from collections.abc import Iterable

_SHOWN_LENGTH = 200

Choice = TypeVar("Choice", bound=str)

#: Codes of the faults of one place of the input.
Code = Literal[
    "ambiguous",
    "cannot-assemble",
    "circular",
    "conflict",
    "empty",
    "exactly-one",
    "inertia-insufficient",
    "invalid-choice",
    "invalid-formula",
    "invalid-machine",
    "invalid-path",
    "invalid-range",
    "invalid-table",
    "invalid-text",
    "invalid-time",
    "missing-unit",
    "motor-overrun",
    "motor-stalled",
    "near-singular",
    "negative-inertia",
    "no-clutch-law",
    "not-a-grid",
    "ambiguous-comma",
    "ambiguous-point",
    "ambiguous-unit",
    "not-a-number",
    "not-an-axis",
    "not-finite",
    "not-fixed",
    "not-numeric",
    "not-used",
    "nothing-in-common",
    "nothing-varies",
    "out-of-range",
    "quadrature-not-reached",
    "repeated",
    "required",
    "too-long",
    "too-many",
    "too-many-faults",
    "unbalanced-work",
    "unequal-lengths",
    "unknown-field",
    "unknown-name",
    "unknown-value",
    "unreadable",
    "unsupported-version",
    "wrong-type",
    "wrong-unit",
]

#: Codes of warnings: what is allowed but probably unintended.
WarningCode = Literal[
    "added-vibration",
    "ambiguous-point",
    "angular-frequency",
    "assumed-units",
    "exceeds-chunk-timeout",
    "falls-over",
    "implausible-value",
    "impossible-inertia",
    "invalid-drives",
    "late",
    "law-ends-falling",
    "law-falls",
    "law-jumps",
    "many-runs",
    "mixed-origins",
    "near-resonance",
    "never-acts",
    "no-compression",
    "no-discharge",
    "no-effect",
    "no-such-angle",
    "nothing-acts",
    "not-monotonic",
    "nothing-moves",
    "reduced-motion",
    "replaced-value",
    "rows-in-backlash",
    "several-speeds",
    "short-search",
    "short-window",
    "slow-excitation",
    "stays-upright",
    "table-ends-early",
    "terms-cancel",
    "tolerance-cut",
    "too-few-rows",
    "torque-reverses",
    "unstable-motion",
    "wide-limit",
    "wraps-around",
]

#: Kinds of failures as a whole; over HTTP the last part of a problem's type.
Kind = Literal[
    "bad-request",
    "body-too-large",
    "case-not-found",
    "cross-site",
    "idempotency-conflict",
    "internal",
    "invalid-body",
    "invalid-parameter",
    "invalid-selection",
    "invalid-spec",
    "method-not-allowed",
    "not-acceptable",
    "not-computed",
    "not-allowed",
    "not-found",
    "not-owner",
    "precondition-failed",
    "queue-full",
    "quota-exceeded",
    "range-not-satisfiable",
    "read-only",
    "schedule-not-found",
    "storage-full",
    "component-not-found",
    "study-not-found",
    "timed-out",
    "too-costly",
    "too-many-attempts",
    "too-many-requests",
    "too-slow",
    "unauthorized",
    "unavailable",
    "unsupported-media-type",
    "user-exists",
    "user-not-found",
    "view-not-found",
    "wrong-host",
    "wrong-state",
    # Kinds of commands, the client and the database; over HTTP, those of the database are `unavailable`.
    "database-busy",
    "database-damaged",
    "database-forbidden",
    "database-in-use",
    "database-read-only",
    "database-replaced",
    "database-unreachable",
    "file-exists",
    "invalid-data",
    "invalid-database-url",
    "invalid-file",
    "invalid-settings",
    "missing-extra",
    "move-differs",
    "not-a-database",
    "not-done",
    "target-not-empty",
    "token-not-found",
    "unknown-tables",
    "unreachable",
    "unsupported-database",
    "write-failed",
    "wrong-revision",
]


class ClauseError(ValueError):
    """A value that is wrong, by itself.

    ``message`` is one clause without the value, a `Sentence` or a text of the catalogue; ``code`` is stable.
    """

    def __init__(self, code: Code, message: str) -> None:
        super().__init__(message)
        self.code: Code = code
        self.message = message


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault of the input.

    Attributes
    ----------
    where : str or None
        JSON Pointer (RFC 6901) to the field, "" for the whole document; for a file a line, for a command an option.
    code : str
        One of `Code`.
    message : str
        Description of the fault, without the value: a `Sentence`, or a text of the catalogue.
    value : object
        The value received, shortened, always plain JSON data; a `Sentence` where it was computed.
    allowed : str or None
        The allowed range or choices.
    unit : str or None
        The SI unit of the field.
    """

    place: ClassVar[str] = "pointer"

    where: str | None
    code: Code
    message: str
    value: Any = None
    allowed: str | None = None
    unit: str | None = None

    @property
    def unit_to_tell(self) -> str | None:
        """The unit, where there is one that ``allowed`` does not name already."""
        return None if self.unit in {None, "1"} or (self.unit or "") in (self.allowed or "") else self.unit

    def __str__(self) -> str:
        details = []
        if self.value is not None:
            details.append(f"got {self.value!r}" if isinstance(self.value, str) else f"got {self.value}")
        if self.allowed is not None:
            details.append(f"allowed: {self.allowed}")
        if self.unit_to_tell:
            details.append(f"unit {self.unit_to_tell}")
        where = self.where or "(the whole spec)"
        return f"{where}: {self.message}" + (f" ({'; '.join(details)})" if details else "")

    def to_json(self) -> dict[str, Any]:
        """The fault as JSON data; ``sentences`` has those of its texts that have values in them, to be translated."""
        texts = {"message": self.message, "value": self.value, "allowed": self.allowed}
        sentences = {name: text.to_json() for name, text in texts.items() if isinstance(text, Sentence) and text.parts}
        return {
            self.place: self.where,
            "code": self.code,
            "message": self.message,
            "value": self.value,
            "allowed": self.allowed,
            "unit": self.unit,
            **({"sentences": sentences} if sentences else {}),
        }


class ParameterFault(Fault):
    """One fault of a parameter of a request; ``where`` is its name."""

    __slots__ = ()
    place = "parameter"


class FaultError(SpragError):
    """A failure that is reported to the caller; ``sprag_study.service.http.problems`` defines its form over HTTP.

    Attributes
    ----------
    code : str
        Kind of the fault, stable: one of `Kind`.
    detail : str
        Description of this failure, as a sentence.
    faults : tuple of Fault
        Every faulty place, where there can be several.
    retry_after : int or None
        Seconds after which another attempt makes sense.
    """

    code: str
    faults: tuple[Fault, ...]

    def __init__(self, code: Kind, detail: str, faults: Iterable[Fault] = (), retry_after: int | None = None) -> None:
        super().__init__(detail)
        self.code = code
        self.detail = detail
        self.faults = tuple(faults)
        self.retry_after = retry_after

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (type(self), self.args, self.__dict__)


def _restored(kind: type[FaultError], args: tuple[Any, ...], state: dict[str, Any]) -> FaultError:
    """Restore a fault that another process raised."""
    fault = kind.__new__(kind, *args)
    fault.__dict__.update(state)
    return fault


def parameter_error(name: str, code: Code, message: str, value: Any = None, allowed: str | None = None) -> FaultError:
    """A `FaultError` about one parameter of the request."""
    fault = ParameterFault(name, code, message, shown(value), allowed)
    return FaultError("invalid-parameter", f"{name}: {message}", (fault,))


class SelectionError(FaultError):
    """The selection of cases is ambiguous or impossible; ``faults`` names each parameter at fault."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        faults = tuple(faults)
        super().__init__("invalid-selection", "; ".join(f"{item.where}: {item.message}" for item in faults), faults)


def refused(
    parameter: str,
    code: Code,
    message: str,
    value: object = None,
    *,
    allowed: str | None = None,
    unit: str | None = None,
) -> SelectionError:
    """What is wrong with one parameter of a selection."""
    return SelectionError([ParameterFault(parameter, code, message, shown(value), allowed, unit)])


def choice_of(name: str, value: str, choices: Iterable[Choice]) -> Choice:
    """``value`` as one of ``choices``; FaultError about the parameter ``name`` when it is none of them."""
    known = list(choices)
    if value in known:
        return value
    raise parameter_error(name, "invalid-choice", Sentence("unknown {name}", name=name), value, ", ".join(known))


class Warned(TypedDict):
    """What an answer with warnings has."""

    warnings: list[str]
    warning_codes: list[str | None]


def warned(warnings: Iterable[str]) -> Warned:
    """The fields of an answer with warnings: the sentences, and their codes (None in databases of earlier versions)."""
    texts = list(warnings)
    return {"warnings": texts, "warning_codes": [getattr(text, "code", None) for text in texts]}


def shown(value: Any) -> Any:
    """``value`` truncated for an answer; only text can be long here."""
    if isinstance(value, str) and len(value) > _SHOWN_LENGTH:
        return value[: _SHOWN_LENGTH - 1] + "\N{HORIZONTAL ELLIPSIS}"
    return value
