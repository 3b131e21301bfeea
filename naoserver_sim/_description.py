"""Describe a body with its looks, for programs that show robots, such as the editor's page.

`python -m naoserver_sim._description FILE` writes the default one as JSON, as `Description` serves it;
`--body` names another one.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from naoserver.bodies import DEFAULT_BODY
from naoserver.bodies.description import write_looks
from naoserver.body import write_body
from naoserver.errors import RobotError
from naoserver_sim.named_body import named_body
from zenoh_ice.application.cli import run

app: Final = typer.Typer(add_completion=False)


@app.command()
def describe(
    file: Annotated[Path, typer.Argument(help="The JSON file to write.")],
    body: Annotated[str, typer.Option(help="Name of a body, or path of its TOML file.")] = DEFAULT_BODY,
    text: Annotated[
        Path | None, typer.Option(help="File with the text that the TOML file is to have.")
    ] = None,
) -> None:
    """Write a body and its looks."""
    facts = named_body(body, text=None if text is None else text.read_text("utf-8"))
    file.write_text(f'{{"body":{write_body(facts)},"looks":{write_looks(facts)}}}\n', encoding="utf-8")


if __name__ == "__main__":
    run(app, expected=(RobotError,))
