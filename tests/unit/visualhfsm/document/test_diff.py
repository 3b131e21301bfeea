"""Compare, merge and search documents."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.hfsm import write_document
from codegen.hfsm.document import Document, Text
from codegen.messages import Message
from tests.support.editing import choose_command, find_problems, large_document, tree
from tests.support.examples import examples
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands import Command
from visualhfsm._document.commands.automata import AddAutomaton
from visualhfsm._document.commands.component import AddEntry, ChangeEntry, RemoveEntry
from visualhfsm._document.commands.items import DeleteItems, MoveItems
from visualhfsm._document.commands.states import AddState, MarkInitial, RenameState
from visualhfsm._document.commands.text import SetText
from visualhfsm._document.commands.transitions import AddTransition, RenameTransition, ReorderTransition
from visualhfsm._document.diff import diff_documents
from visualhfsm._document.places import Place, search
from visualhfsm._document.serialization import parse
from visualhfsm._document.subtrees import without_automata
from visualhfsm.project._editing.merge import Merged, Typed, merge_documents, merge_lines, merge_typing


def done(document: Document, *commands: Command) -> Document:
    for command in commands:
        document = command.apply(document)
    return document


def listed(before: Document, after: Document) -> list[str]:
    return [
        f"{each.kind} {each.place.kind} {each.place.automaton}/{each.place.id} {each.part}: {each.before} > {each.after}"
        for each in diff_documents(before, after)
    ]


def rename(name: str, state: int = 1, automaton: int = 1) -> RenameState:
    return RenameState(automaton=automaton, state=state, name=name)


def code(text: str) -> SetText:
    return SetText(place=Place(kind="state", automaton=1, id=1, part="code"), text=text)


def test_a_diff_lists_what_was_added_removed_changed_and_moved() -> None:
    after = done(
        tree(),
        rename("rest"),
        SetText(place=Place(kind="state", automaton=1, id=1, part="entry"), text="a = 1"),
        MoveItems(automaton=1, states=(1,), transitions=(1, 2), dx=5, dy=0),
        AddState(automaton=1, x=0, y=0, name="new"),
        DeleteItems(automaton=2, states=(2,)),
    )
    assert listed(tree(), after) == [
        "changed state 1/1 name: wait > rest",
        "changed state 1/1 entry:  > a = 1",
        "moved state 1/1 : 100, 100 > 105, 100",
        "added state 1/3 :  > new",
        "moved transition 1/1 : 200, 80 > 205, 80",
        "moved transition 1/2 : 200, 120 > 205, 120",
        "removed state 2/2 : out > ",
        "removed transition 2/1 : t > ",
    ]


def test_a_diff_lists_automata_data_and_order() -> None:
    after = done(
        without_automata(tree(), {3}),
        AddEntry(list="parameters", fields={"name": "speed"}),
        AddTransition(automaton=1, origin=1, destination=2),
    )
    after = done(after, ReorderTransition(automaton=1, transition=3, index=0))
    assert listed(tree(), after) == [
        "added document 0/0 :  > speed",
        "changed state 1/2 children: 2, 3 > 2",
        "added transition 1/3 :  > transition 3",
        "changed automaton 1/0 transitions order:  > ",
        "removed automaton 3/0 :  > ",
    ]  # fmt: skip


def test_entries_that_share_a_name_are_distinguished_by_their_order() -> None:
    twins = done(
        tree(),
        AddEntry(list="parameters", fields={"name": "a", "default": "1"}),
        AddEntry(list="parameters", fields={"name": "a", "default": "2"}),
    )
    assert listed(twins, done(twins, ChangeEntry(list="parameters", index=0, fields={"default": "3"}))) == [
        "changed document 0/0 default: 1 > 3"
    ]


def test_failures_to_survive_are_matched_by_part_and_kind() -> None:
    before = AddEntry(list="survives", fields={"part": "LKneePitch", "kind": "weak"}).apply(tree())
    after = done(
        before,
        ChangeEntry(list="survives", index=0, fields={"amount": "0.5"}),
        AddEntry(list="survives", fields={"part": "Camera", "kind": "black"}),
    )
    assert listed(before, after) == [
        "changed document 0/0 amount:  > 0.5",
        "added document 0/0 :  > Camera black",
    ]


def test_the_same_has_no_differences() -> None:
    assert diff_documents(tree(), parse(write_document(tree()), Message("Cannot read"))) == []


def merged(mine: Sequence[Command], theirs: Sequence[Command], base: Document | None = None) -> Merged:
    start = base or tree()
    return merge_documents(start, done(start, *mine), done(start, *theirs))


@pytest.mark.parametrize(
    ("base", "mine", "theirs", "together"),
    [
        ("a\nb\nc\nd\n", "A\nb\nc\nd\n", "a\nb\nc\nD\n", "A\nb\nc\nD\n"),
        ("a\nb\nc\n", "new\na\nb\nc\n", "a\nc\n", "new\na\nc\n"),
        ("a\nb\nc", "A\nb\nc", "a\nb\nc\nd", "A\nb\nc\nd"),
        ("a\nb\nc\n", "A\nb\nc\nd\n", "A\nb\nc\n", "A\nb\nc\nd\n"),
        ("a\nb\n", "A\nb\n", "A\nb\n", "A\nb\n"),
        ("a\nb\n", "A\nb\n", "a\nB\n", None),
        ("a\nb\n", "a\nx\nb\n", "a\ny\nb\n", None),
        ("a", "b", "c", None),
        ("", "b", "c", None),
    ],
)
def test_texts_are_merged_by_lines(base: str, mine: str, theirs: str, together: str | None) -> None:
    assert merge_lines(base, mine, theirs) == together
    assert merge_lines(base, theirs, mine) == together
    assert merge_lines(base, mine, base) == merge_lines(base, base, mine) == mine


@pytest.mark.parametrize(
    ("base", "mine", "theirs", "together"),
    [
        ("", "mine", "theirs", "minetheirs"),
        ("x", "xmm", "xtt", "xmmtt"),
        ("xmm", "xmmmm", "xmmtt", "xmmmmtt"),
        ("a = 1\nb = 2", "a = 1 + 1\nb = 2", "a = 1\nb = 23\nc", "a = 1 + 1\nb = 23\nc"),
        ("red or green", "or green", "red or greenish", "or greenish"),
        ("one two", "two", "two", "two"),
        ("abc def", "ac def", "abc d", "ac d"),
    ],
)
def test_what_both_type_is_kept(base: str, mine: str, theirs: str, together: str) -> None:
    assert merge_typing(base, mine, theirs) == Typed(together, conflict=False)


@pytest.mark.parametrize(
    ("mine", "theirs", "together"),
    [("color = green", "color = blue", "color = greenblue"), ("color = red", "color = blue", "color = blue")],
)
def test_words_that_both_replace_are_a_conflict(mine: str, theirs: str, together: str) -> None:
    assert merge_typing("color = red", mine, theirs) == Typed(together, conflict="green" in together)


@given(st.randoms(use_true_random=False))
@settings(max_examples=examples(30))
def test_no_letter_is_lost_that_two_type_at_once(random: Random) -> None:
    document = "".join(random.choices("abcdefghi \n", k=random.randrange(60)))
    writers: list[dict[str, Any]] = [
        {"base": document, "text": document, "at": random.randint(0, len(document))} for _ in "PQ"
    ]
    typed = {"P": 0, "Q": 0}
    for _ in range(30):
        letter, writer = random.choice([*zip("PQ", writers, strict=True)])
        if random.random() < 0.6:
            text, at = writer["text"], writer["at"]
            writer.update(text=text[:at] + letter + text[at:], at=at + 1)
            typed[letter] += 1
        else:
            document = merge_typing(writer["base"], writer["text"], document).text
            writer.update(base=writer["text"])
    for writer in writers:
        document = merge_typing(writer["base"], writer["text"], document).text
    assert {letter: document.count(letter) for letter in typed} == typed


def test_code_that_both_changed_in_other_lines_is_merged() -> None:
    start = done(tree(), code("first()\nsecond()\nthird()\n"))
    outcome = merged([code("FIRST()\nsecond()\nthird()\n")], [code("first()\nsecond()\nTHIRD()\n")], start)
    assert outcome.conflicts == ()
    assert outcome.document.automata[0].states[0].code.text == "FIRST()\nsecond()\nTHIRD()\n"
    outcome = merged([code("FIRST()\nsecond()\n")], [code("second()\nthird()\n")], start)
    assert outcome.conflicts == ("state “wait” (code): yours stays",)
    assert outcome.document.automata[0].states[0].code.text == "FIRST()\nsecond()\n"


def test_what_only_one_side_changed_is_taken() -> None:
    outcome = merged(
        [
            rename("mine"),
            AddEntry(list="parameters", fields={"name": "a"}),
            DeleteItems(automaton=2, states=(2,)),
        ],
        [
            rename("theirs", 2),
            SetText(place=Place(kind="state", automaton=1, id=1, part="code"), text="y = 2"),
        ],
    )
    assert outcome.conflicts == ()
    first, second = outcome.document.automata[0].states
    assert (first.name, first.code.text, second.name) == ("mine", "y = 2", "theirs")
    assert [each.name for each in outcome.document.parameters] == ["a"]
    assert len(outcome.document.automata[1].states) == 1


def test_what_both_changed_stays_mine_and_is_reported() -> None:
    outcome = merged([rename("mine")], [rename("theirs")])
    assert outcome.conflicts == ("state “mine” (name): yours stays",)
    assert outcome.document.automata[0].states[0].name == "mine"
    assert merged([rename("same")], [rename("same")]).conflicts == ()


def test_new_things_of_both_sides_get_numbers_of_their_own() -> None:
    outcome = merged(
        [AddState(automaton=1, x=0, y=0, name="mine"), AddTransition(automaton=1, origin=3, destination=1)],
        [AddState(automaton=1, x=9, y=9, name="theirs"), AddTransition(automaton=1, origin=3, destination=2)],
    )
    root = outcome.document.automata[0]
    assert outcome.conflicts == ()
    assert sorted((each.id, each.name) for each in root.states[2:]) == [(3, "mine"), (4, "theirs")]
    assert sorted((each.id, each.origin, each.destination) for each in root.transitions[2:]) == [
        (3, 3, 1),
        (4, 4, 2),
    ]


def test_new_automata_of_both_sides_get_numbers_of_their_own() -> None:
    outcome = merged(
        [AddAutomaton(automaton=1, state=1), AddState(automaton=5, x=0, y=0, name="mine")],
        [AddAutomaton(automaton=1, state=2), AddState(automaton=5, x=0, y=0, name="theirs")],
    )
    assert outcome.conflicts == ()
    assert [each.children for each in outcome.document.automata[0].states] == [(5,), (2, 3, 6)]
    assert {each.id: each.states[0].name for each in outcome.document.automata if each.id > 4} == {
        5: "mine",
        6: "theirs",
    }


def test_what_one_side_changed_and_the_other_deleted_stays() -> None:
    changing: list[Command] = [rename("x", 2, 2)]
    deleting: list[Command] = [DeleteItems(automaton=2, states=(2,))]
    for outcome in (merged(changing, deleting), merged(deleting, changing)):
        assert [each.name for each in outcome.document.automata[1].states] == ["in", "x"]
        assert outcome.conflicts == ("state “x” (deleted on one side): it stays",)


@pytest.mark.parametrize(
    ("mine", "theirs", "code"),
    [
        (DeleteItems(automaton=1, states=(2,)), AddTransition(automaton=1, origin=1, destination=2), "E514"),
        (DeleteItems(automaton=1, states=(2,)), rename("x", 1, 4), "E512"),
        (MarkInitial(automaton=1, state=2), MarkInitial(automaton=1, state=3), "W513"),
    ],
    ids=["a transition to a deleted state", "an automaton of a deleted state", "two initial states"],
)
def test_what_does_not_fit_together_stays_and_is_for_the_checks(
    mine: Command, theirs: Command, code: str
) -> None:
    base = done(tree(), AddState(automaton=1, x=0, y=0))
    document = merged([mine], [theirs], base).document
    assert code in [each.code for each in find_problems(write_document(document), None)]


def test_new_transitions_of_new_states_are_distinguished_by_their_destination() -> None:
    new: list[Command] = [
        AddState(automaton=1, x=0, y=0),
        AddTransition(automaton=1, origin=3, destination=1),
    ]
    outcome = merged([*new, rename("mine", 3)], [*new, rename("theirs", 3)])
    root = outcome.document.automata[0]
    assert outcome.conflicts == ()
    assert [(each.id, each.origin) for each in root.transitions[2:]] == [(3, 3), (4, 4)]


def test_both_may_add_something_of_one_name() -> None:
    mine = [AddEntry(list="parameters", fields={"name": "a", "default": "1.0"})]
    outcome = merged(mine, [AddEntry(list="parameters", fields={"name": "a", "default": "2.0"})])
    assert [each.default for each in outcome.document.parameters] == [Text("1.0")]
    assert outcome.conflicts == ("parameter a (new on both sides): yours stays",)
    base = done(tree(), *mine)
    outcome = merged(
        [RemoveEntry(list="parameters", index=0)],
        [ChangeEntry(list="parameters", index=0, fields={"default": "3.0"})],
        base,
    )
    assert [each.default for each in outcome.document.parameters] == [Text("3.0")]
    assert outcome.conflicts == ("parameter a (deleted on one side): it stays",)


def test_failures_that_both_sides_state_are_merged() -> None:
    base = AddEntry(list="survives").apply(tree())
    mine = ChangeEntry(list="survives", index=0, fields={"must": "succeed"})
    theirs = AddEntry(list="survives", fields={"part": "LKneePitch", "kind": "stuck"})
    both = merged([mine], [theirs], base)
    assert not both.conflicts
    assert [(each.failure, each.must) for each in both.document.survives] == [
        ("Camera black", "succeed"),
        ("LKneePitch stuck", ""),
    ]


def test_an_order_that_one_side_changed_is_taken() -> None:
    base = done(tree(), *[AddTransition(automaton=1, origin=1, destination=2)] * 2)
    for mine, theirs in (
        ([ReorderTransition(automaton=1, transition=4, index=0)], [RenameTransition(automaton=1, transition=1, name="x")]),
        ([RenameTransition(automaton=1, transition=1, name="x")], [ReorderTransition(automaton=1, transition=4, index=0)]),
    ):  # fmt: skip
        outcome = merged(mine, theirs, base)
        assert [each.id for each in outcome.document.automata[0].transitions] == [4, 2, 1, 3]
        assert outcome.document.automata[0].transitions[2].name == "x"


def random_document(seed: int, start: Document, commands: int = 15) -> Document:
    random = Random(seed)
    document = start
    for _ in range(commands):
        try:
            document = choose_command(random, document).apply(document)
        except EditError:
            continue
    return document


@settings(max_examples=examples(15), deadline=None)
@given(mine=st.integers(0, 2**32), theirs=st.integers(0, 2**32))
def test_any_two_versions_make_a_document_that_can_be_saved(mine: int, theirs: int) -> None:
    base = tree()
    here, there = random_document(mine, base), random_document(theirs, base)
    outcome = merge_documents(base, here, there).document
    assert parse(write_document(outcome), Message("Cannot read")) == outcome
    assert merge_documents(base, here, base).document == here
    assert merge_documents(base, base, there).document == there
    assert merge_documents(base, here, here).document == here
    for automaton in outcome.automata:
        states = [state.id for state in automaton.states]
        assert len(set(states)) == len(states)
    ids = [automaton.id for automaton in outcome.automata]
    assert len(set(ids)) == len(ids)
    assert (diff_documents(here, there) == []) == (here == there)


@pytest.mark.parametrize(
    ("text", "hits"),
    [
        ("WAIT", [("state", "name", 1, 1)]),
        ("x", [("state", "code", 1, 1), ("transition", "trigger", 1, 1)]),
        ("", []),
    ],
)
def test_names_and_code_are_searched(text: str, hits: list[tuple[str, str, int, int]]) -> None:
    found = search(tree(), text)
    assert [(each.place.kind, each.place.part, each.line, each.column) for each in found] == hits


def test_a_whole_word_is_found_in_its_case_alone() -> None:
    code = "ball = Ball(ball, football, ball_2).ball"
    document = done(tree(), SetText(place=Place(kind="state", automaton=1, id=2, part="exit"), text=code))
    assert [each.column for each in search(document, "ball", whole=True)] == [1, 13, 37]
    assert len(search(document, "BALL")) == 6
    assert search(document, "BALL", whole=True) == []


def test_a_hit_is_shown_with_its_line() -> None:
    document = done(
        tree(),
        SetText(
            place=Place(kind="state", automaton=1, id=2, part="exit"), text=f"a = 1\n  {'b' * 300} = needle"
        ),
    )
    (hit,) = search(document, "needle")
    assert (hit.line, hit.column, hit.length) == (2, 306, 6)
    assert hit.excerpt.endswith("b = needle")
    assert hit.excerpt[hit.start :] == "needle"
    assert len(hit.excerpt) <= 160


def test_hits_in_one_line_are_distinguished() -> None:
    document = done(
        tree(),
        SetText(place=Place(kind="state", automaton=1, id=2, part="exit"), text="  needle = needle + 1"),
    )
    one, two = search(document, "needle")
    assert one.excerpt == two.excerpt == "needle = needle + 1"
    assert (one.start, two.start) == (0, 9)


def test_a_search_ends_after_a_thousand_hits() -> None:
    assert len(search(large_document(2000), "state")) == 1000


def test_state_names_that_differ_in_nothing_else_are_one_difference() -> None:
    base = tree()
    root = base.automata[0]
    other = replace(
        base,
        automata=(
            replace(root, states=(replace(root.states[0], name="w"), root.states[1])),
            *base.automata[1:],
        ),
    )
    assert listed(base, other) == ["changed state 1/1 name: wait > w"]
