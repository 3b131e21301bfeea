"""What several commands of `visualhfsm` share: options, and the examples below their help."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from codegen.options import ErrorFormat

Include = Annotated[
    list[Path] | None,
    typer.Option("-I", "--include", metavar="DIR", help="Also search DIR for proxies and imported files."),
]
ErrorsAs = Annotated[ErrorFormat, typer.Option("--error-format", help="Format of the diagnostics on stderr.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]


def examples(*commands: str, notes: str = "") -> str:
    """Return what stands below the help of a command: uses of `visualhfsm`, each without that word."""
    return "\n\n".join(["Examples:", *(f"visualhfsm {each}" for each in commands), notes]).rstrip()
