"""Views of plug-ins: what is wrong with one costs the page no other."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

from tests.support.plugins import installed
from visualhfsm._editor import protocol as p
from visualhfsm._editor.views import begun, find_views, offered

CHESS = """
from pathlib import Path
from visualhfsm.plugins import TabRequest

class ShowBoard(TabRequest):
    square: str = "a1"

class Undo(TabRequest):
    pass

class View:
    static = Path(__file__).parent / "static"

    def __init__(self, *requests):
        self.requests = dict.fromkeys(requests)

    def offers(self, path):
        if path is None:
            raise ValueError("no board")
        if path.suffix == ".chess960":
            raise SystemExit(0)
        return path.suffix == ".chess"

    def begin(self, publish, include):
        if not self.requests:
            raise ValueError("no clock")
        return self.requests

chess, taken, idle = View(ShowBoard), View(Undo), View()
"""


@pytest.fixture
def static(tmp_path: Path) -> Path:
    folder = tmp_path / "static"
    folder.mkdir()
    (folder / "view.js").write_text("export {};\n")
    return folder


@pytest.mark.usefixtures("static")
def test_a_view_is_found_and_offered_for_its_documents(tmp_path: Path) -> None:
    with installed(tmp_path, {"visualhfsm.views": {"chess": "stranger:chess"}}, stranger=CHESS):
        views = {"chess": find_views(p.REQUESTS)["chess"]}  # others are offered for any document
        assert [kind.__name__ for kind in views["chess"].requests] == ["ShowBoard"]
        assert offered(views, Path("a.chess")) == ["chess"]
        assert offered(views, Path("a.xml")) == []


@pytest.mark.usefixtures("static")
def test_a_view_that_fails_is_not_offered(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with installed(tmp_path, {"visualhfsm.views": {"chess": "stranger:chess"}}, stranger=CHESS):
        views = {"chess": find_views(p.REQUESTS)["chess"]}  # others are offered for any document
        assert offered(views, None) == offered(views, Path("a.chess960")) == []
    assert "the view chess is not offered" in caplog.text


@pytest.mark.usefixtures("static")
@pytest.mark.parametrize("point", ["chess = taken", "chess = nothing", "a/b = chess", "chess = View"])
def test_what_cannot_be_a_view_is_left_out_and_logged(
    tmp_path: Path, point: str, caplog: pytest.LogCaptureFixture
) -> None:
    name, _, value = point.partition(" = ")
    points = {name: f"stranger:{value}", "board": "stranger:chess"}
    with installed(tmp_path, {"visualhfsm.views": points}, stranger=CHESS):
        assert "chess" not in (views := find_views(p.REQUESTS))
        assert "board" in views
    assert "the page has no view " in caplog.text
    assert [each.levelno for each in caplog.records] == [logging.WARNING]


def test_a_view_without_a_module_is_left_out(tmp_path: Path) -> None:
    with installed(tmp_path, {"visualhfsm.views": {"chess": "stranger:chess"}}, stranger=CHESS):
        assert "chess" not in find_views(p.REQUESTS)


@pytest.mark.usefixtures("static")
def test_a_view_that_cannot_begin_keeps_no_other_from_it(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    points = {"visualhfsm.views": {"chess": "stranger:chess", "idle": "stranger:idle"}}
    with installed(tmp_path, points, stranger=CHESS):
        found = find_views(p.REQUESTS)
        views = {name: found[name] for name in ("idle", "chess")}
        assert [*begun(views, lambda _: None, ())] == ["chess"]
    assert "the view idle does nothing for documents" in caplog.text
    assert "no clock" in caplog.text
