from __future__ import annotations

from itertools import combinations, product

from hypothesis import given
from hypothesis import strategies as st

from codegen.logic import Conjunction, satisfy

atoms = st.sampled_from("abcd")
clauses = st.dictionaries(atoms, st.booleans(), max_size=3).map(lambda needs: tuple(needs.items()))


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
