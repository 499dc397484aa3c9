"""Questions of views as parameters of routes: each setting is one, with its limits, its meaning and its examples."""

from __future__ import annotations

from inspect import Parameter, Signature
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import Query

from sprag.service.views.questions import Asked, settings_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def one_of(names: Any) -> dict[str, Any]:
    """``json_schema_extra`` of a text with these values only; generated clients still treat it as a text."""
    return {"pattern": f"^({'|'.join(names)})$"}


def with_question(
    endpoint: Callable[..., Any], question: type, before: Mapping[str, Any], after: Mapping[str, Any] | None = None
) -> None:
    """Give ``endpoint`` the parameters of a question, between others.

    ``before`` and ``after`` are annotations by name; those of ``after`` have the default None.
    """
    fixed = [Parameter(name, Parameter.KEYWORD_ONLY, annotation=kind) for name, kind in before.items()]
    last = [
        Parameter(name, Parameter.KEYWORD_ONLY, default=None, annotation=kind) for name, kind in (after or {}).items()
    ]
    endpoint.__signature__ = Signature([*fixed, *map(_parameter, settings_of(question)), *last])  # type: ignore[attr-defined]


def _parameter(asked: Asked) -> Parameter:
    setting = asked.setting
    limits = {"ge": setting.low, "le": setting.high, "max_length": setting.longest}
    extra = one_of(setting.choices) if setting.choices else None
    query = Query(
        alias=setting.alias or None,
        description=setting.meaning,
        examples=list(setting.examples) or None,
        json_schema_extra=extra,
        **{name: limit for name, limit in limits.items() if limit is not None},  # type: ignore[arg-type]
    )
    default = Parameter.empty if asked.default is ... else asked.default
    return Parameter(asked.name, Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[asked.type, query])
