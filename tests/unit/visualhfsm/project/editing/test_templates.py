"""Templates of new documents."""

from __future__ import annotations

import sys

import pytest

from visualhfsm._base.errors import EditError
from visualhfsm._processes.robots import find_worlds
from visualhfsm.project._editing.templates import find_templates, make_template


def test_there_is_an_empty_template_and_the_behaviors_without_importing_them() -> None:
    modules = set(sys.modules)
    templates = find_templates()
    assert [each.name for each in templates] == [
        "empty",
        "dance",
        "dance_and_follow",
        "drive_to_ball",
        "follow_ball",
        "get_up",
        "score",
        "team_score",
    ]
    assert all(each.description for each in templates)
    assert not {name for name in set(sys.modules) - modules if name.startswith("behaviors")}
    assert make_template("")[1] == make_template("empty")[1]
    name, document = make_template("follow_ball")
    assert name == "follow_ball"
    assert len(document.automata[0].states) > 1
    _, document = make_template("dance_and_follow")  # wherever the new document is saved, it is whole
    assert not [each for each in document.automata if each.imported]
    assert len(document.automata[2].states) > 1
    assert make_template("score")[1].world.text in {world.name for world in find_worlds()}
    with pytest.raises(EditError, match="there is no template"):
        make_template("../x")
