from __future__ import annotations

import ast
from itertools import combinations, product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from codegen.hfsm.model_checker._guards import Conjunction, conjunction, satisfy

atoms = st.sampled_from("abcd")
clauses = st.dictionaries(atoms, st.booleans(), max_size=3).map(lambda needs: tuple(needs.items()))


def _tree(text: str) -> ast.expr | None:
    try:
        return ast.parse(text.strip(), mode="eval").body
    except SyntaxError:
        return None


def holds(clause: Conjunction, values: dict[str, bool]) -> bool:
    return all(values[atom] is value for atom, value in clause)


@given(clauses, st.lists(clauses, max_size=6))
def test_satisfy_finds_values_exactly_when_there_are_some(
    wanted: Conjunction, refused: list[Conjunction]
) -> None:
    found = satisfy(wanted, refused)
    possible = [
        values
        for row in product([False, True], repeat=4)
        if holds(wanted, values := dict(zip("abcd", row, strict=True)))
        and not any(holds(clause, values) for clause in refused)
    ]
    if found is None:
        assert not possible
    else:
        assert dict.fromkeys("abcd", False) | found in possible


def entangled(one: str, other: str) -> list[Conjunction]:
    """Return clauses that cannot all be false."""
    return [((one, first), (other, second)) for first, second in product([True, False], repeat=2)]


def test_guards_that_have_nothing_to_do_with_one_another_are_looked_at_alone() -> None:
    free: list[Conjunction] = [((f"x{number}", True), (f"y{number}", True)) for number in range(60)]
    assert satisfy((), [*free, *entangled("a", "b")]) is None
    found = satisfy((), free)
    assert found is not None
    values = dict.fromkeys((atom for clause in free for atom, _ in clause), False) | found
    assert not any(holds(clause, values) for clause in free)


def test_guards_that_are_too_entangled_count_as_possible() -> None:
    # Twelve pigeons do not fit into eleven holes, and there is no quick way to see that.
    pigeons, holes = range(12), range(11)
    somewhere: list[Conjunction] = [tuple((f"{p} in {h}", False) for h in holes) for p in pigeons]
    alone: list[Conjunction] = [
        ((f"{p} in {h}", True), (f"{q} in {h}", True)) for h in holes for p, q in combinations(pigeons, 2)
    ]
    assert satisfy((), [*somewhere, *alone]) is not None


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
        ("True", ()),
        ("1", ()),
        ("not False and True", ()),
        ("False", None),
        ("None", None),
        ("a and not a", None),
        ("a and 0", None),
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
