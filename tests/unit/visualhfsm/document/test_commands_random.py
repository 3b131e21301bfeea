"""Random commands: every result can be saved, read again, undone and redone.

`TEST_EXAMPLES=10` runs ten times as many sequences of 50 commands.
"""

from __future__ import annotations

from pathlib import Path
from random import Random

import msgspec
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from codegen.hfsm import write_document
from codegen.hfsm.document import Automaton, Document, State, Transition
from codegen.messages import Message
from tests.support.editing import choose_command, tree
from tests.support.examples import examples
from visualhfsm import Project
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands import decode_command
from visualhfsm._document.serialization import parse

COMMANDS_EACH = 50

ODD = Document(
    automata=(
        Automaton(
            id=1,
            states=(
                State(id=1, name="one", children=(1, 7)),
                State(id=1, name="twin", children=(2,)),
                State(id=2, name="two", initial=True, children=(2, 3, 3)),
            ),
            transitions=(
                Transition(id=1, origin=1, destination=9),
                Transition(id=1, origin=0, destination=0),
                Transition(id=2, origin=2, destination=2),
            ),
        ),
        Automaton(id=2, father=3, states=(State(id=1, name="loop", children=(1, 3)),)),
        Automaton(id=3, father=2, states=(State(id=4, name="loop", children=(2,)),)),
        Automaton(id=3, father=8),
        Automaton(id=5, father=0),
    )
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("start", [tree(), Document(), ODD], ids=["tree", "empty", "odd"])
@settings(
    max_examples=examples(7),
    deadline=None,
    phases=[Phase.explicit, Phase.reuse, Phase.generate],
)
@given(seed=st.integers(0, 2**32))
def test_every_sequence_of_commands_can_be_saved_undone_and_done_again(
    tmp_path_factory: pytest.TempPathFactory, start: Document, seed: int
) -> None:
    random = Random(seed)
    folder = tmp_path_factory.getbasetemp()
    session = Project(folder, journals=folder / "journals").open_text("random", write_document(start))
    try:
        original = text = write_document(session.version.document)
        for _ in range(COMMANDS_EACH):
            before = session.version.document
            command = choose_command(random, before)
            assert decode_command(msgspec.json.encode(command)) == command
            try:
                session.apply(command)
            except EditError:
                assert session.version.document is before
                continue
            after, former = session.version.document, text
            text = write_document(after)
            assert parse(text, Message("Cannot read")) == after
            if after is not before:
                assert text != former
        last = write_document(session.version.document)
        names = [step.name for step in session.version.undo]
        while session.version.undo:
            session.undo()
        assert write_document(session.version.document) == original
        assert [step.name for step in session.version.redo] == names[::-1]
        while session.version.redo:
            session.redo()
        assert write_document(session.version.document) == last
    finally:
        session.close(discard=True)


def test_the_odd_document_is_one_that_can_be_saved() -> None:
    assert parse(write_document(ODD), Message("Cannot read"), Path("odd.xml")) == ODD
