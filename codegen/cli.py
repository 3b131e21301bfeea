"""The entry of `codegen`: it ends quietly while modules load."""

from __future__ import annotations

from startup import loading


def main() -> None:
    """Run the command `codegen`."""
    with loading():
        from .command import app
    app(prog_name="codegen")
