"""A group of commands, one of which is meant when none is named."""

from __future__ import annotations

import typer
from typer.core import TyperGroup

__all__ = ["DEFAULT_COMMAND", "DefaultGroup"]

DEFAULT_COMMAND = "generate"
_OF_THE_GROUP = frozenset({"--help"})


class DefaultGroup(TyperGroup):
    """Take what is no command's name for arguments of the default command."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Put the default command before arguments that name none."""
        named = bool(args) and (args[0] in self.commands or args[0] in _OF_THE_GROUP)
        if not named and not (ctx.resilient_parsing and not args):
            args = [DEFAULT_COMMAND, *args]
        return super().parse_args(ctx, args)

    def format_options(self, ctx: typer.Context, formatter: object) -> None:  # type: ignore[override]
        """Show the options of the default command, then the commands."""
        self.commands[DEFAULT_COMMAND].format_options(ctx, formatter)  # type: ignore[arg-type]
        self.format_commands(ctx, formatter)  # type: ignore[arg-type]
