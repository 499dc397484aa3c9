"""``sprag show SPEC|ID WHAT``: every view of a study and of a case, by its name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import typer
from typer._click.shell_completion import CompletionItem

from sprag_study.sentences import Sentence
from sprag_study.service.cli import case_views, cases, completion, regimes, remote, settle, sql, study_views
from sprag_study.service.cli.console import WrongInputError, wrong_option
from sprag_study.service.cli.described import listing
from sprag_study.service.cli.groups import Groups
from sprag_study.service.cli.options import SHARED
from sprag_study.service.languages import N_, _

#: Whether something is named already, for completion.
_NAMED: Final = f"{__name__}.named"


class _Views(Groups):
    """The views: the study is named before or behind the view, and alone it is shown itself."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the view first; without one the study itself is meant."""
        ctx.meta[_NAMED] = bool(args)
        place = self.place(args)
        if place is None:
            itself = args and not args[0].startswith("-") and not ctx.resilient_parsing
            if itself and args[1:] and not args[1].startswith("-"):
                raise self._no_view(args[0], args[1])
            return super().parse_args(ctx, ["state", *args] if itself else args)
        if place + 1 < len(args) and args[place + 1] in self.commands:  # a study of that name
            place += 1
        return super().parse_args(ctx, [args[place], *args[:place], *args[place + 1 :]])

    def _no_view(self, study: str, name: str) -> WrongInputError:
        """The refusal of a view that there is not: it names the nearest, and those that the study has."""
        from sprag_study.service.reading.texts import did_you_mean

        message = Sentence("is no view{hint}", hint=did_you_mean(name, self.commands))
        allowed = ", ".join(remote.views_of(study, self.commands))
        return wrong_option("WHAT", "unknown-name", message, name, allowed=allowed, detail=_("invalid argument"))

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """The views, and before one the studies of the service."""
        studies = [] if ctx.meta[_NAMED] else completion.studies(ctx, incomplete)
        known = [CompletionItem(name, help=text) for name, text in studies if name.startswith(incomplete)]
        return [*super().shell_complete(ctx, incomplete), *known]


app = typer.Typer(
    help="Show a study: its state, or a view of it or of one of its cases.\n\nA spec is run here first. "
    "`sprag show WHAT -h` lists which of the options below a view has: --units is of a study and of `case`, --by and "
    "--at are of views with axes, --case and --start of one case.",
    no_args_is_help=True,
    cls=_Views,
    options_metavar="SPEC|ID",
    subcommand_metavar="[WHAT] [OPTIONS]",
)


app.callback()(listing(**SHARED))
_OF_STUDY, _OF_CASE = N_("Of a study"), N_("Of one case (--case N)")
_COMMANDS: Final[dict[str, dict[str, Callable[..., None]]]] = {
    _OF_STUDY: {
        "state": remote.state,
        **study_views.COMMANDS,
        "cases": cases.cases,
        "rounds": remote.rounds,
        "sql": sql.sql,
    },
    _OF_CASE: {"case": cases.case, **case_views.COMMANDS, "settled": settle.settle, "regimes": regimes.regimes},
}
for _title, _commands in _COMMANDS.items():
    for _name, _command in _commands.items():
        app.command(_name, rich_help_panel=_title, options_metavar="[OPTIONS]")(_command)
