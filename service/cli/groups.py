"""Commands in groups, whose help lists them under their titles."""

from __future__ import annotations

from typing import Any, Final

from typer.core import TyperGroup

#: Longest first sentence of a help text.
_SENTENCE: Final = 400


class Groups(TyperGroup):
    """A command with commands; help is plain text, because rich would take as long to load as everything else."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002 - typer's signature
        """Write the name and the first sentence of each command."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for name, command in self.commands.items():
            title = getattr(command, "rich_help_panel", None) or "Commands"
            groups.setdefault(title, []).append((name, command.get_short_help_str(limit=_SENTENCE)))
        for title, rows in groups.items():
            with formatter.section(title):
                formatter.write_dl(rows)
