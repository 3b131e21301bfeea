"""The bodies that can be simulated: those that are installed, and those of a project's folder `robots`."""

from __future__ import annotations

from pathlib import Path

import pytest

from naoserver.bodies import BODY_NAMES, DEFAULT_BODY, find_body
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.languages import said
from visualhfsm._processes.bodies import body_option, called, find_bodies, require_body


def test_installed_bodies_are_known_by_their_names_and_titles(tmp_path: Path) -> None:
    bodies = find_bodies(tmp_path)
    assert tuple(body.name for body in bodies) == BODY_NAMES
    assert bodies[0].name == DEFAULT_BODY
    for body in bodies:
        assert body.title.startswith(find_body(body.name).title)


def test_a_title_is_said_in_the_language_of_a_page_where_it_is_no_name() -> None:
    assert [said(called(title), "es") for title in ("Cart", "Nao H25")] == ["Carro", "Nao H25"]


def test_bodies_of_the_project_are_known_by_their_files(tmp_path: Path) -> None:
    robots = tmp_path / "robots"
    robots.mkdir()
    (robots / "arm.toml").write_text('title = "An arm"\nname = "Arm"\nmodel = "arm.urdf"\n')
    (robots / "cart.toml").write_text('name = "MyCart"\nmodel = "cart.xml"\n')
    (robots / "broken.toml").write_text("[groups\n")
    (robots / "odd.toml").write_text('title = 7\nname = "  "\n')
    (robots / "binary.toml").write_bytes(b"\xff\xfe")
    (robots / "arm.urdf").write_text("<robot/>")
    (robots / ".draft.toml").write_text('name = "Draft"\n')
    own = find_bodies(tmp_path)[len(BODY_NAMES) :]
    assert [(each.name, each.title) for each in own] == [
        ("robots/arm.toml", "An arm"),
        ("robots/binary.toml", "binary"),
        ("robots/broken.toml", "broken"),
        ("robots/cart.toml", "MyCart"),
        ("robots/odd.toml", "odd"),
    ]
    assert body_option(tmp_path, require_body(tmp_path, "robots/arm.toml")) == str(robots / "arm.toml")
    assert body_option(tmp_path, require_body(tmp_path, "H21")) == "H21"
    assert require_body(tmp_path, "") == DEFAULT_BODY


@pytest.mark.parametrize("name", ["h25", "--help", "../robots/arm.toml", "robots/none.toml", "/etc/passwd"])
def test_another_body_is_refused_with_those_that_there_are(tmp_path: Path, name: str) -> None:
    with pytest.raises(VisualHfsmError, match=r"there is no robot .*; there are H25, H21"):
        require_body(tmp_path, name)
