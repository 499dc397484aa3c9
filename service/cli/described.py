"""Described questions as options of commands (`sprag_study.service.views.setting`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from inspect import Parameter, Signature
from typing import Annotated, Any, Final

import typer

from sprag_study.service.cli import completion
from sprag_study.service.views.setting import NamedSetting

#: Defaults of options that groups list, where they are not None.
_DEFAULTS: Final = {"case": 0, "wait": False}


def signed(run: Callable[..., None], about: str, parameters: Sequence[Parameter]) -> Callable[..., None]:
    """A command: a function with its help and its arguments and options."""
    run.__doc__ = about
    run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    return run


def listing(**shared: Any) -> Callable[..., None]:
    """What a group has of its own: options of its commands, which its help lists once."""

    def run(**_options: Any) -> None:
        """Nothing: the commands read them."""

    return signed(run, "", [parameter(name, kind, _DEFAULTS.get(name)) for name, kind in shared.items()])


def parameter(name: str, annotation: Any, default: Any) -> Parameter:
    default = Parameter.empty if default is ... else default
    return Parameter(name, Parameter.POSITIONAL_OR_KEYWORD, annotation=annotation, default=default)


#: What the shell offers for a value, by what stands for it in the help.
_COMPLETED: dict[str, Callable[..., Any]] = {
    "PATH": completion.parameters, "RESULT": completion.results, "NAME": completion.quantities,
    "ENDING": completion.endings, "REGIME": completion.regimes, "FLAG": completion.flags, "SORT": completion.sortings,
}  # fmt: skip


def option(asked: NamedSetting) -> Any:
    """A setting as an option."""
    setting = asked.setting
    meaning = f"{setting.meaning[0].upper()}{setting.meaning[1:]}."
    if asked.type is bool:
        return Annotated[bool, typer.Option(asked.option, help=meaning)]
    if asked.type is int:
        return Annotated[
            int | None, typer.Option(asked.option, metavar="N", help=meaning, min=setting.low, max=setting.high)
        ]
    if setting.positional:
        return Annotated[list[str], typer.Argument(metavar=f"{setting.metavar}...", help=meaning)]
    texts = list[str] if asked.several else asked.type
    given = texts if asked.default is ... else texts | None
    metavar = f"[{'|'.join(asked.choices)}]" if asked.choices else setting.metavar
    offered = _offering(asked.choices) if asked.choices else _COMPLETED.get(setting.metavar)
    return Annotated[given, typer.Option(asked.option, metavar=metavar, help=meaning, autocompletion=offered)]


def _offering(choices: Sequence[str]) -> Callable[[str], list[str]]:
    """Completion of a value by its choices."""

    def offered(incomplete: str) -> list[str]:
        return [choice for choice in choices if choice.startswith(incomplete)]

    return offered


def query_of(asked: Sequence[NamedSetting], settings: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Settings as the query of the view's address, without those that are as the service has them anyway."""
    from sprag_study.service.client.queries import query_of as query

    return query({one.alias: settings[one.name] for one in asked if settings[one.name] != one.default})
