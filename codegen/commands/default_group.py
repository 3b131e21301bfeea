"""A group of commands, one of which is meant when none is named."""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperGroup

__all__ = ["DEFAULT_COMMAND", "DefaultGroup"]

DEFAULT_COMMAND = "generate"
_OF_THE_GROUP = frozenset({"--help", "--install-completion", "--show-completion"})


class DefaultGroup(TyperGroup):
    """Take what is no command's name for arguments of the default command."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Put the default command before arguments that name none."""
        named = bool(args) and (args[0] in self.commands or args[0] in _OF_THE_GROUP)
        if not named and not (ctx.resilient_parsing and not args):
            args = [DEFAULT_COMMAND, *args]
        return super().parse_args(ctx, args)

    def shell_complete(self, ctx: typer.Context, incomplete: str) -> list[Any]:  # type: ignore[override]
        """Propose the options of the default command beside what the group has."""
        default = self.commands[DEFAULT_COMMAND].shell_complete(ctx, incomplete)
        proposals = {item.value: item for item in (*super().shell_complete(ctx, incomplete), *default)}
        return list(proposals.values())

    def format_options(self, ctx: typer.Context, formatter: Any) -> None:  # type: ignore[override]  # noqa: ANN401
        """Show the options of the default command, then those of completion, then the commands."""
        self.commands[DEFAULT_COMMAND].format_options(ctx, formatter)
        own = (param.get_help_record(ctx) for param in self.params)
        with formatter.section("Completion"):
            formatter.write_dl([record for record in own if record is not None])
        self.format_commands(ctx, formatter)
