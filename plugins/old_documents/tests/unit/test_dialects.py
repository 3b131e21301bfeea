"""Documents in old dialects become the same model, and nothing in them is lost."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document, write_document
from codegen.hfsm.document import NATIVE, Element
from plugins.old_documents.tests.support.document_comparison import differences
from plugins.old_documents.tests.support.old_dialects import SPANISH, VISUALSTATES, read
from tests.support.examples import examples

PATH = Path("old.xml")


@pytest.mark.parametrize(
    "text",
    [
        '<VisualStates><state id="0"><name>root</name><state id="1"><code>go();</code></state></state></VisualStates>',
        "<VisualHFSM><SubAutomata><idSub>1</idSub><Estado><codigo>go();</codigo></Estado></SubAutomata></VisualHFSM>",
    ],
)
def test_the_language_of_an_old_dialect_is_guessed_and_the_guess_is_reported(text: str) -> None:
    reported = "N502: most of the code looks like C++: it is kept as C++, but cannot run"
    document, found = read(text)
    assert document.language.text == "C++"
    assert reported in found
    document, found = read(text.replace("();", "()"))
    assert document.language.text == ""
    assert reported not in found


@pytest.mark.parametrize(
    ("text", "dialect"),
    [
        (SPANISH, "Spanish (2013)"),
        ("<VisualStates><SubAutomata><Estado/></SubAutomata></VisualStates>", "Spanish (2013)"),
        ("<VisualHFSM><nombreEsquema/></VisualHFSM>", "Spanish (2013)"),
        (VISUALSTATES, "VisualStates (2017)"),
        ("<VisualHFSM><state/></VisualHFSM>", "VisualStates (2017)"),
        ("<VisualStates><functions/></VisualStates>", "VisualStates (2017)"),
        ("<VisualStates><SubAutomata id='1'/></VisualStates>", NATIVE),
        ("<VisualHFSM><SubAutomata id='1'/><state/></VisualHFSM>", NATIVE),
        ("<VisualHFSM/>", NATIVE),
        ("<VisualStates><config/></VisualStates>", NATIVE),
    ],
)  # fmt: skip
def test_the_dialect_is_recognized_by_the_children_not_by_the_root(text: str, dialect: str) -> None:
    document, _ = read(text)
    assert document.format == dialect


@pytest.mark.parametrize("text", [SPANISH, VISUALSTATES], ids=["2013", "VisualStates"])
def test_nothing_is_lost(text: str, tmp_path: Path) -> None:
    path = tmp_path / "old.xml"
    path.write_text(text)
    document, _ = read(text)
    written = write_document(document)
    assert differences(path, written) == []
    again, found = read(written)
    assert again == document
    assert not [message for message in found if not message.startswith("N501")]


# 2013


# VisualStates


def test_what_stands_twice_is_kept_and_the_first_counts() -> None:
    text = "<VisualStates><state><state id='1'><name>a</name><name>b</name></state></state></VisualStates>"
    document, found = read(text)
    (state,) = document.automata[0].states
    assert (state.name, state.extras) == ("a", (Element("kept", children=(Element("name", (), "b"),)),))
    assert found[0].startswith("W504")


def test_ids_that_are_missing_are_chosen_and_reported() -> None:
    document, found = read(
        "<VisualStates><state initial='True'><state id=''><transition><type>0</type><time>1</time></transition></state>"
        "<state id='1'/></state></VisualStates>"
    )
    assert [state.id for state in document.automata[0].states] == [2, 1]
    (transition,) = document.automata[0].transitions
    assert (transition.id, transition.origin, transition.destination) == (1, 2, 0)
    assert [message[:4] for message in found] == ["W502"] * 3


@pytest.mark.parametrize(
    "text",
    [
        "<VisualStates><state><state id='one'/></state></VisualStates>",
        "<VisualStates><state><state id='1'><posx>left</posx></state></state></VisualStates>",
        "<VisualStates><state><state id='1' initial='maybe'/></state></VisualStates>",
        "<VisualHFSM><SubAutomata><idSub>one</idSub></SubAutomata></VisualHFSM>",
        "<VisualHFSM><SubAutomata><idSub>1</idSub><Estado><id>1</id><origenX>inf</origenX></Estado></SubAutomata></VisualHFSM>",
    ],
)
def test_a_malformed_number_is_reported_with_its_place(text: str) -> None:
    diagnostics = Diagnostics()
    assert parse_document(text, PATH, diagnostics) is None
    (error,) = diagnostics.errors
    assert (error.code, error.location.line) == ("E506", 1)


# Whatever somebody's editor, disk or hand did to a document, it loads or says why not.

_cuts = st.tuples(
    st.floats(0, 1),
    st.integers(0, 40),
    st.sampled_from(["", "<a/>", "<state id='1'>", "&lt;", "0", "-", "\x00", "é"]),
)


@settings(max_examples=examples(20), deadline=None)
@given(st.sampled_from([SPANISH, VISUALSTATES]), st.lists(_cuts, max_size=4))
def test_no_mutation_does_more_than_report_errors(text: str, cuts: list[tuple[float, int, str]]) -> None:
    for place, length, new in cuts:
        start = int(place * len(text))
        text = text[:start] + new + text[start + length :]
    _read_or_refuse(text)


_TAGS = """state transition name posx code timestep namespace functions variables type time condition originid
    destinationid config configs interfaces interface libraries library global_namespace parameters param
    Estado SubAutomata idSub idPadre id hijo codigo transiciones transicion box destino tiempo Librerias lib
    nombre kept pseudostate entry final child"""
_tags = st.sampled_from(_TAGS.split())
_trees = st.recursive(
    st.builds(
        lambda tag, text: f"<{tag}>{text}</{tag}>",
        _tags,
        st.sampled_from(["", "1", "0", "x y", "1,5", "True"]),
    ),
    lambda inner: st.builds(
        lambda tag, key, children: f"<{tag} id='{key}'>{''.join(children)}</{tag}>",
        _tags,
        st.sampled_from(["", "1", "2"]),
        st.lists(inner, max_size=4),
    ),
    max_leaves=20,
)


@settings(max_examples=examples(20), deadline=None)
@given(st.sampled_from(["VisualHFSM", "VisualStates"]), st.lists(_trees, max_size=4))
def test_any_tree_of_known_words_is_read_or_refused_and_kept(root: str, children: list[str]) -> None:
    _read_or_refuse(f"<{root}>{''.join(children)}</{root}>")


def _read_or_refuse(text: str) -> None:
    diagnostics = Diagnostics()
    document = parse_document(text, PATH, diagnostics)
    assert (document is None) == diagnostics.has_errors
    if document is not None:
        written = write_document(document)
        again = parse_document(written, PATH, diagnostics)
        assert again == document, diagnostics.render()
        assert write_document(again) == written
