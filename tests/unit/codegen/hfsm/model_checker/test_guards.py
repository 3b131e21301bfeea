from __future__ import annotations

import ast

import pytest

from codegen.hfsm.model_checker._guards import conjunction
from codegen.logic import Conjunction


def _tree(text: str) -> ast.expr | None:
    try:
        return ast.parse(text.strip(), mode="eval").body
    except SyntaxError:
        return None


@pytest.mark.parametrize(
    ("text", "needs"),
    [
        ("seen", (("seen", True),)),
        ("not seen", (("seen", False),)),
        ("not not seen", (("seen", True),)),
        ("a and not b", (("a", True), ("b", False))),
        ("not (a or b)", (("a", False), ("b", False))),
        ("a or b", (("a or b", True),)),
        ("a and a", (("a", True),)),
        ("x  >  1", (("x > 1", True),)),
        ("x is not None", (("x is None", False),)),
        ("not x != 1", (("x == 1", True),)),
        ("x not in (1, 2)", (("x in (1, 2)", False),)),
        ("x != 1 != y", (("x != 1 != y", True),)),
        ("x <= 1", (("x <= 1", True),)),
        ("True", ()),
        ("1", ()),
        ("not False and True", ()),
        ("False", None),
        ("None", None),
        ("a and not a", None),
        ("a and 0", None),
        ("not set()", (("set()", False),)),
        ("set() == 1", (("set() == 1", True),)),
        ("  \n", (("", True),)),
        ("return x > 1", (("return x > 1", True),)),
        ("{", (("{", True),)),
    ],
)
def test_a_guard_is_a_conjunction_of_atoms(text: str, needs: Conjunction | None) -> None:
    assert conjunction(_tree(text), text.strip(), "here") == needs


def test_a_guard_that_changes_each_time_it_is_asked_is_an_atom_of_its_own() -> None:
    text = "random.random() < 0.5"
    assert conjunction(_tree(text), text, f"{text} [3]", is_steady=False) == ((f"{text} [3]", True),)
