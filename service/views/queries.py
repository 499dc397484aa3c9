"""What a view is asked, as the query of an address has it: texts by the aliases of settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeVar

from pydantic import Field, TypeAdapter, ValidationError

from sprag_study.service.faults import Fault, FaultError, ParameterFault, shown
from sprag_study.service.views.setting import settings_of

if TYPE_CHECKING:
    from sprag_study.service.faults import Code
    from sprag_study.service.views.setting import NamedSetting

Question = TypeVar("Question")

#: Descriptions of the patterns of texts.
_PATTERNS: Final = {r"^[!-~]+$": "printable ASCII characters without blanks"}


def asked(question: type[Question], query: Sequence[tuple[str, str]]) -> Question:
    """The question of a query; FaultError "invalid-parameter" with a fault for each setting that is wrong."""
    values: dict[str, Any] = {}
    faults: list[Fault] = []
    for setting in settings_of(question):
        place = ("query", setting.alias)
        texts = [text for alias, text in query if alias == setting.alias]
        if texts:
            try:
                values[setting.name] = _adapter(setting).validate_python(texts if setting.several else texts[-1])
            except ValidationError as error:
                faults += [parameter_fault({**fault, "loc": place}) for fault in error.errors()]
        elif setting.default is ...:
            faults.append(parameter_fault({"type": "missing", "msg": "Field required", "loc": place}))
    if faults:
        detail = "; ".join(f"{fault.where}: {fault.message}" for fault in faults)
        raise FaultError("invalid-parameter", detail, faults)
    return question(**values)


def _adapter(setting: NamedSetting) -> TypeAdapter[Any]:
    limits = Field(**setting.setting.limits)  # type: ignore[call-overload]
    kind: Any = Annotated[setting.type, limits]
    return TypeAdapter(kind)


def parameter_fault(fault: Mapping[str, Any]) -> Fault:
    """A fault of a parameter, of one that pydantic tells."""
    _place, *name = fault["loc"]
    bounds = fault.get("ctx", {})
    value = fault.get("input")
    message = str(fault["msg"]).removeprefix("Value error, ")
    if "pattern" in bounds:
        message = "has characters that are not allowed here"
    return ParameterFault(
        str(name[0]) if name else _place,
        _code(str(fault["type"])),
        message[:1].lower() + message[1:],
        value=shown(value) if isinstance(value, str) else None,
        allowed=_allowed(bounds),
    )


def _code(kind: str) -> Code:
    """The code of a pydantic error."""
    if kind == "missing":
        return "required"
    if kind in ("literal_error", "enum"):
        return "invalid-choice"
    if kind in ("greater_than", "greater_than_equal", "less_than", "less_than_equal"):
        return "out-of-range"
    if kind in ("too_long", "string_too_long"):
        return "too-long"
    return "invalid-text" if kind.startswith(("string", "value_error")) else "wrong-type"


def _allowed(bounds: dict[str, Any]) -> str | None:
    signs = {"ge": ">=", "gt": ">", "le": "<=", "lt": "<", "expected": "one of"}
    parts = [f"{signs[name]} {value}" for name, value in bounds.items() if name in signs]
    if "pattern" in bounds:
        parts.append(_PATTERNS.get(bounds["pattern"], f"a text like {bounds['pattern']}"))
    return " and ".join(parts) or None
