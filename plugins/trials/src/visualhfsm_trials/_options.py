"""Options that the commands of trials have in common."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Seed = Annotated[int | None, typer.Option(metavar="N", min=0, help="Seed of everything that is drawn.")]
Workers = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, max=1000, help="Trials at a time.", show_default="one a processor"),
]
Cluster = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Run on a cluster of Dask, such as tcp://HOST:8786.")
]
Out = Annotated[
    Path | None,
    typer.Option(metavar="DIR", file_okay=False, help="Where outcomes are kept; by default beside DOCUMENT."),
]
Again = Annotated[
    bool, typer.Option("--again", help="Replace outcomes that are there, instead of going on with them.")
]
