"""Questions of views as parameters of routes: each setting is one, with its limits, its meaning and its examples."""

from __future__ import annotations

from functools import wraps
from inspect import Parameter, Signature, signature
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import Query

from sprag_study.service.views.setting import NamedSetting, settings_of

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Collection, Iterable


def one_of(names: Iterable[str]) -> dict[str, Any]:
    """``json_schema_extra`` of a text with these values only; generated clients still treat it as a text."""
    return {"pattern": f"^({'|'.join(names)})$"}


def asking(
    endpoint: Callable[..., Awaitable[Any]], question: type, without: Collection[str] = ()
) -> Callable[..., Awaitable[Any]]:
    """An operation whose parameter ``question`` is given as its settings, each a parameter of the query.

    The parameters ``without`` are left out and are None.
    """
    settings = settings_of(question)
    parameters: list[Parameter] = []
    for own in signature(endpoint, eval_str=True).parameters.values():
        if own.name == "question":
            parameters += map(_parameter, settings)
        elif own.name not in without:
            parameters.append(own.replace(kind=Parameter.KEYWORD_ONLY))

    @wraps(endpoint)
    async def asked(**given: Any) -> Any:
        values = {one.name: given.pop(one.name) for one in settings}
        return await endpoint(question=question(**values), **given, **dict.fromkeys(without))

    asked.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    return asked


def _parameter(asked: NamedSetting) -> Parameter:
    setting = asked.setting
    query = Query(
        alias=setting.alias or None,
        description=setting.meaning,
        examples=list(setting.examples) or None,
        json_schema_extra=one_of(setting.choices) if setting.choices else None,
        **setting.limits,  # type: ignore[arg-type]
    )
    default = Parameter.empty if asked.default is ... else asked.default
    return Parameter(asked.name, Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[asked.type, query])
