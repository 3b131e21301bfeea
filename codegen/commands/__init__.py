"""The command `codegen` and its sub-commands, one module each.

Nothing heavy is imported before a command runs, so that `--help` and completion answer at once.
"""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperGroup

from .breaking import breaking
from .format import fmt
from .generate import generate
from .inspect import describe, fingerprint

__all__ = ["app"]

_DEFAULT_COMMAND = "generate"
_EXAMPLES = """\b
  codegen interfaces/*.idl              packages beside the files: interfaces/jderobot, ...
  codegen robot.idl -I slice -o api     the package api/, with includes found in slice/
  codegen behaviors/follow_ball.xml     the component behaviors/follow_ball.py
  codegen --check interfaces/*.idl      exit 1 and show a diff when something is stale
  codegen --watch interfaces/*.idl      generate again at every change"""

_OF_THE_GROUP = frozenset({"--help", "--install-completion", "--show-completion"})


class _DefaultGroup(TyperGroup):
    """Take what is no command's name for arguments of the default command."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Put the default command before arguments that name none."""
        named = bool(args) and (args[0] in self.commands or args[0] in _OF_THE_GROUP)
        if not named and not (ctx.resilient_parsing and not args):
            args = [_DEFAULT_COMMAND, *args]
        return super().parse_args(ctx, args)

    def shell_complete(self, ctx: typer.Context, incomplete: str) -> list[Any]:  # type: ignore[override]
        """Propose the options of the default command beside what the group has."""
        default = self.commands[_DEFAULT_COMMAND].shell_complete(ctx, incomplete)
        proposals = {item.value: item for item in (*super().shell_complete(ctx, incomplete), *default)}
        return list(proposals.values())

    def format_options(self, ctx: typer.Context, formatter: Any) -> None:  # type: ignore[override]  # noqa: ANN401
        """Show the options of the default command, then those of completion, then the commands."""
        self.commands[_DEFAULT_COMMAND].format_options(ctx, formatter)
        own = (param.get_help_record(ctx) for param in self.params)
        with formatter.section("Completion"):
            formatter.write_dl([record for record in own if record is not None])
        self.format_commands(ctx, formatter)


app = typer.Typer(
    cls=_DefaultGroup,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    subcommand_metavar="FILES... | COMMAND [ARGS]...",
    epilog=f"""Examples:

{_EXAMPLES}

Exit codes: 0 done, 1 errors in the files or, with --check, something stale, 2 wrong usage.
`codegen COMMAND --help` explains a command; docs/codegen.md explains all.""",
)


@app.callback()
def codegen() -> None:
    """Generate Python from interfaces in Slice and from automaton documents.

    Interfaces become packages of typed structs, proxies and servants; an automaton document becomes a
    component that runs it. All files are written, or none when there is an error; a file that would not
    change is not touched.
    """


app.command(_DEFAULT_COMMAND, epilog=f"Examples:\n\n{_EXAMPLES}")(generate)
app.command(
    epilog="""Examples:

\b
  codegen fmt interfaces/*.idl            lay out the files
  codegen fmt --check interfaces/*.idl    exit 1 and show a diff when one is not"""
)(fmt)
app.command(
    epilog="""Examples:

\b
  codegen breaking --against main interfaces/*.idl
  codegen breaking --against v1.0 --kind wire --ignore B202 interfaces/*.idl
  codegen breaking --against ../released --error-format github robot.idl"""
)(breaking)
app.command(
    epilog="""Example:

\b
  codegen fingerprint interfaces/posehead.idl"""
)(fingerprint)
app.command(
    epilog="""Examples:

\b
  codegen describe PoseHead interfaces/*.idl
  codegen describe nao::PoseHead::setPose interfaces/posehead.idl"""
)(describe)
