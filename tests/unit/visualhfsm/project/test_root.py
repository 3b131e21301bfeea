"""The files that a project reaches."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.any_text import any_text
from visualhfsm._base.errors import ForbiddenPathError, MissingError
from visualhfsm.project._root import Root

parts = st.one_of(
    st.sampled_from(["..", ".", "", "a", "b.xml", "away", "/", "~", "\\"]), any_text(max_size=8)
)


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Root:
    outside = tmp_path_factory.mktemp("outside")
    inside = outside / "root"
    (inside / "a").mkdir(parents=True)
    (inside / "away").symlink_to(outside)
    (inside / "loop").symlink_to(inside / "loop")
    return Root(inside, granted=[outside / "named.xml"])


@given(path=st.lists(parts, max_size=6).map("/".join))
def test_no_path_leads_out(root: Root, path: str) -> None:
    for reach in (root.resolve, root.document, root.model, root.directory_of):
        with contextlib.suppress(ForbiddenPathError):
            assert reach(path).resolve().is_relative_to(root.directory)


def test_the_files_of_the_command_line_are_reached(root: Root) -> None:
    named = root.directory.parent / "named.xml"
    assert root.document("../named.xml") == root.document(str(named)) == named
    assert root.name(named) == str(named)
    with pytest.raises(ForbiddenPathError, match="--root"):
        root.document("../other.xml")


def test_documents_are_named_by_their_way_from_the_root(root: Root) -> None:
    assert root.name(root.document("a/../a/robot.XML")) == "a/robot.XML"
    assert root.directory_of("") == root.directory


@pytest.mark.parametrize(
    "path", ["", "a", "robot.py", "loop.xml/../loop", "\0.xml", "loop/x.xml", 300 * "x" + ".xml"]
)
def test_what_is_no_document_is_refused(root: Root, path: str) -> None:
    with pytest.raises(ForbiddenPathError):
        root.document(path)


def test_a_root_has_to_be_there(tmp_path: Path) -> None:
    with pytest.raises(MissingError, match="there is no folder"):
        Root(tmp_path / "missing")


@pytest.mark.parametrize("path", [f"new/{'a' * 252}.xml", f"new/{'ä' * 126}.xml", "new/\ud800.xml"])
def test_a_name_that_no_file_can_have_is_refused(root: Root, path: str) -> None:
    with pytest.raises(ForbiddenPathError):
        root.document(path)
