"""docs/gallery.md and its pictures: every behavior, exercise and ready state, and one line to run it.

python -m tools.gallery.page [NAME ...]    # also renews pictures by name or part, such as "Goals", or `all`
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from textwrap import fill
from typing import Final, NamedTuple

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from tools.gallery.scenes import BEHAVIORS, EXERCISES, GOALS, ROOT, SHELF, Scene
from visualhfsm.project._editing.shelf import Shelves

PAGE: Final = ROOT / "docs/gallery.md"
PICTURES: Final = ROOT / "docs/pictures/gallery"
MATCH: Final = "team_score"
"""The behavior that plays in a match; alone, its robot strikes."""

_BEGINNING: Final = (
    "What comes along, as it runs on simulated robots in MuJoCo; at the foot of a picture stands the state "
    "that the robot is in. Some pictures run two, three or four times as fast. "
    "`python -m tools.gallery.page` makes this page from the documents, and films them; a test proves that "
    "nothing is left out, and that each line to run is taken."
)
_TEXTS: Final = {
    "Goals": "One document scores on every humanoid, unchanged: start its robot, and press *Run* in "
    "`visualhfsm edit behaviors/score.xml`. [Football in 30 minutes](tutorial/football.md) explains it.",
    "Behaviors": "Open one in the editor, and press *Run*; "
    "[trials](../plugins/trials/docs/trials.md) show how well it does.",
    "Exercises": "For [a class](../plugins/classes/docs/class.md): the pictures show the solutions, "
    "which pupils do not see.",
    "Ready states": "Drawn from the [shelf](how-to/shelf.md) of the editor; all have "
    "[inputs](reference/shelf.md).",
}
_NAMES: Final = {"H25": "Nao", "T1": "Booster T1", "G1": "Unitree G1", "Cart": "cart"}


class Entry(NamedTuple):
    """Something that is shown: its picture, its document, what it shows, and one line to run it."""

    part: str
    name: str
    picture: str
    document: Path
    title: str
    text: str
    line: str
    scene: Scene | None


def entries() -> Iterator[Entry]:
    """Yield all, in the order of the page."""
    from visualhfsm_classes._exercise import SOLUTION, read_exercise

    score = ROOT / "behaviors/score.xml"
    for body, goal in {"H25": BEHAVIORS["score"], **GOALS}.items():
        name = "score" if body == "H25" else f"score_{body}"
        title = f"A goal of the {_NAMES[body]}"
        line = f"naoserver-sim --world soccer --noise --body {body}"
        yield Entry("Goals", name, f"behaviors-{name}", score, title, "", line, goal)
    for path in sorted((ROOT / "behaviors").glob("*.xml")):
        name = path.stem
        line = f"visualhfsm edit behaviors/{name}.xml"
        if name == MATCH:
            line = f"visualhfsm match behaviors/{name}.xml behaviors/{name}.xml --minutes 4"
        picture = f"behaviors-{name}"
        yield Entry("Behaviors", name, picture, path, name, _description(path), line, BEHAVIORS.get(name))
    for folder in sorted(path.parent for path in (ROOT / "exercises").glob("*/exercise.toml")):
        exercise = read_exercise(folder)
        asked = [each.asks["en"] for each in exercise.criteria]
        title, text = exercise.title["en"], "; ".join(asked) + "."
        line = f"visualhfsm new my-{folder.name} --exercise {folder.name}"
        document, scene = folder / SOLUTION, EXERCISES.get(folder.name)
        yield Entry("Exercises", folder.name, f"exercises-{folder.name}", document, title, text, line, scene)
    for state in Shelves(ROOT).states():
        path = ROOT / state.path
        line = f"visualhfsm edit {state.path}"
        name = path.stem
        yield Entry(
            "Ready states", name, f"shelf-{name}", path, state.title, state.summary, line, SHELF.get(name)
        )


def gallery() -> str:
    """Return the page."""
    parts = ["# Gallery", fill(_BEGINNING, 120)]
    for each in entries():
        if f"## {each.part}" not in parts:
            parts += [f"## {each.part}", fill(_TEXTS[each.part], 120)]
        parts.append(f"### {each.title}")
        parts.append(f"![{each.title}](pictures/gallery/{each.picture}.webp)")
        if each.text:
            parts.append(fill(each.text, 120))
        parts.append(f"```sh\n{each.line}\n```")
    return "\n\n".join(parts) + "\n"


def _description(path: Path) -> str:
    document = read_document(path, Diagnostics())
    assert document is not None
    return " ".join(document.description.text.split())


def main(names: list[str]) -> None:
    """Renew the page, and some pictures."""
    PAGE.write_text(gallery(), "utf-8")
    if not names:
        return
    from tools.gallery.films import beside, film, write  # needs GL

    PICTURES.mkdir(exist_ok=True)
    for each in entries():
        path = PICTURES / f"{each.picture}.webp"
        if each.scene is not None and ("all" in names or each.part in names or each.picture in names):
            write(film(each.scene, each.document), path)
    goals = (each.picture for each in entries() if each.part == "Goals")
    beside([PICTURES / f"{each}.webp" for each in goals], PICTURES / "goals.webp")


if __name__ == "__main__":
    main(sys.argv[1:])
