"""The task beside a document, which a stranger may have written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.support.places import ROOT
from visualhfsm.project._root import Root
from visualhfsm_classes._task import collected, has_task, read_task

PIXEL = b"GIF89a\x01\x00\x01\x00\x00\x00\x00;"


@pytest.fixture
def document(tmp_path: Path) -> Path:
    """The document of a pupil, in the folder `look` of the root."""
    folder = tmp_path / "root/look"
    folder.mkdir(parents=True)
    (folder / "task.md").write_text("# Look")
    return folder / "look.xml"


def text(document: Path, language: str = "en") -> list[Any]:
    found: list[Any] = read_task(Root(document.parents[1]), document, language)["text"]
    return found


def test_a_task_becomes_elements_that_are_harmless(document: Path) -> None:
    (document.parent / "task.md").write_text(
        "# Say *hi*\n\n3. `a < b`\n4. <script>x</script>\n\n"
        "[web](https://a.example) [bad](javascript:x) [file](/etc/passwd)\n\n    <b>\n"
    )
    assert text(document) == [
        ("h3", {}, ["Say ", ("em", {}, ["hi"])]),
        (
            "ol",
            {"start": "3"},
            [("li", {}, [("code", {}, ["a < b"])]), ("li", {}, ["<script>x</script>"])],
        ),
        ("p", {}, [("a", {"href": "https://a.example"}, ["web"]), " [bad](javascript:x) ", "file"]),
        ("pre", {}, [("code", {}, ["<b>\n"])]),
    ]


def test_the_language_of_the_page_comes_first(document: Path) -> None:
    (document.parent / "task.es.md").write_text("Mira")
    assert text(document, "es") == [("p", {}, ["Mira"])]
    assert text(document, "de") == [("h3", {}, ["Look"])]


def test_nothing_outside_of_the_folder_is_read(document: Path, tmp_path: Path) -> None:
    secret = tmp_path / "root/secret.gif"
    secret.write_bytes(PIXEL)
    (document.parent / "own.gif").write_bytes(PIXEL)
    (document.parent / "link.gif").symlink_to(secret)
    (document.parent / "large.gif").write_bytes(bytes(2 << 20))
    (document.parent / "loop.gif").symlink_to("loop.gif")
    names = (
        "own.gif",
        "link.gif",
        "../secret.gif",
        str(secret),
        "large.gif",
        "loop.gif",
        "none.gif",
        "look.xml",
    )
    (document.parent / "task.md").write_text(
        " ".join(f"![{name}]({name})" for name in names) + " ![x](%00.gif)"
    )
    ((_, _, content),) = text(document)
    pictures = [each for each in content if each[0] == "img"]
    assert [each[1]["alt"] for each in pictures] == ["own.gif"]
    assert pictures[0][1]["src"].startswith("data:image/gif;base64,")
    (document.parent / "task.md").unlink()
    (document.parent / "task.md").symlink_to(secret)
    assert text(document) == []


def test_many_pictures_are_not_all_sent(document: Path) -> None:
    (document.parent / "own.gif").write_bytes(PIXEL)
    (document.parent / "task.md").write_text("![a](own.gif)\n" * 100)
    ((_, _, content),) = text(document)
    assert sum(each[0] == "img" for each in content) < 50


def test_the_author_of_an_exercise_sees_its_points_and_no_solution() -> None:
    start = ROOT / "exercises/look/start.xml"
    assert has_task(start)
    assert not has_task(ROOT / "exercises/look/solution/solution.xml")
    found = read_task(Root(ROOT), start, "es")["text"]
    assert found[0] == ("h3", {}, ["Mira a izquierda y derecha"])
    assert ("td", {}, ["Al principio mira a la izquierda"]) in found[-1][2][1][2][0][2]


@pytest.mark.parametrize(
    ("document_name", "copy"), [("look", "look"), ("second try", "look"), ("nod", "nod")]
)
def test_what_is_collected_has_the_name_of_the_exercise(
    document: Path, document_name: str, copy: str
) -> None:
    root = Root(document.parents[1])
    for name in ("look", "nod"):
        (document.parent / f"{name}.trials.toml").write_text("")
    path = document.with_name(f"{document_name}.xml")
    assert collected(root, path) is None
    (root.directory / "hand-in").mkdir()
    assert collected(root, path) == root.directory / f"hand-in/{copy}.xml"
