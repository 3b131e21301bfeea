"""The command `codegen` and its sub-commands, one module each.

Nothing heavy is imported before a command runs, so that `--help` and completion answer at once.
"""

from __future__ import annotations

import typer

from .breaking import breaking
from .default_group import DEFAULT_COMMAND, DefaultGroup
from .format import fmt
from .generate import generate
from .inspect import decode, describe, fingerprint

__all__ = ["app"]

_EXAMPLES = """\b
  codegen interfaces/*.idl              packages beside the files: interfaces/jderobot, ...
  codegen robot.idl -I slice -o api     the package api/, with includes found in slice/
  codegen behaviors/follow_ball.xml     the component behaviors/follow_ball.py
  codegen --check interfaces/*.idl      exit 1 and show a diff when something is stale
  codegen --watch interfaces/*.idl      generate again at every change"""

app = typer.Typer(
    cls=DefaultGroup,
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


app.command(DEFAULT_COMMAND, epilog=f"Examples:\n\n{_EXAMPLES}")(generate)
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
app.command(
    epilog="""Examples:

\b
  codegen decode nao::HeadPose interfaces/posehead.idl < pose.msgpack
  codegen decode PoseHead::setPose --arguments interfaces/posehead.idl < call.msgpack"""
)(decode)
