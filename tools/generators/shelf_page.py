"""docs/reference/shelf.md, made from the documents in shelf/ by `python -m tools.generators.shelf_page`."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from textwrap import fill
from typing import Final

from tests.support.pages import DOCS
from visualhfsm.project._editing.shelf import ReadyState, Shelves, our_shelf

__all__ = ["PAGE", "shelf_page"]

PAGE: Final = DOCS / "reference/shelf.md"

_TITLE: Final = "# The ready states"
_BEGINNING: Final = """\
Made by `python -m tools.generators.shelf_page` from the documents in `shelf/`; `make lint` proves that it is
current. [Draw ready states](../how-to/shelf.md) explains their use. *Needs* lists the servants that a robot
must [have](robots.md). On a robot that lacks what it needs, a state ends and hands up the `reason`. All are
tested on the fake and the simulated Nao, T1 and G1, upright and lying."""


def shelf_page() -> str:
    """Return the page."""
    parts = [_TITLE, fill(_BEGINNING, 120, break_on_hyphens=False)]
    for category, states in groupby(Shelves(our_shelf().parent).states(), lambda each: each.category):
        parts.append(f"## {category}")
        parts += [part for each in states for part in _state(each)]
    return "\n\n".join(parts) + "\n"


def _state(ready: ReadyState) -> Iterator[str]:
    needs = ", ".join(f"`{each.identity}`" for each in ready.needs)
    yield f"### {ready.title}"
    yield fill(ready.text, 120)
    yield f"Needs {needs}. Its document is `{ready.path}`."
    if ready.inputs:
        rows = [f"| `{each.name}` | `{each.default}` | {each.description} |" for each in ready.inputs]
        yield "\n".join(["| input | default | |", "|---|---|---|", *rows])
    if ready.outputs:
        rows = [f"| `{each.name}` | `{each.default}` | {each.description} |" for each in ready.outputs]
        yield "\n".join(["| output | until then | |", "|---|---|---|", *rows])


if __name__ == "__main__":
    PAGE.write_text(shelf_page(), "utf-8")
