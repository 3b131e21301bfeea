"""Outputs and results: what may be declared, what may take it, and what is probably a mistake."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document
from tests.support.documents import document, state, sub, transition


def output(name: str = "found", type_name: str = "bool", default: str | None = "False") -> str:
    written = "" if default is None else f"<default>{default}</default>"
    return f"<output><name>{name}</name><type>{type_name}</type>{written}</output>"


def result(name: str = "found", variable: str = "seen", child: int = 0) -> str:
    owner = f' child="{child}"' if child else ""
    return f'<result name="{name}"{owner}>{variable}</result>'


def nested(
    *outputs: str,
    results: str = "",
    variables: str = "seen = False",
    own: str = "",
    code: str = "found = True",
    second: str = "",
    above: str = "print(seen)",
    inside: str = "",
) -> str:
    """Return a document whose root owns automata 2 and 3."""
    owner = state(1, "search", above, initial=True, child=2)
    owner = owner.replace("</state>", f"<child>3</child>{results}</state>")
    return document(
        sub(1, 0, owner, own, variables=variables),
        sub(2, 1, state(1, "look", code, initial=True), *(outputs or (output(),)), variables=inside),
        sub(3, 1, state(1, "wait", initial=True), second),
    )


def found_in(directory: Path, text: str) -> list[tuple[str, str]]:
    path = directory / "main.xml"
    path.write_text(text)
    diagnostics = Diagnostics()
    assert (compile_document(path, None, diagnostics) is None) == bool(diagnostics.errors)
    return [(each.code, each.message) for each in diagnostics if each.code not in ("W521", "N515")]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (nested(output("x y")), "`x y` cannot be an output"),
        (nested(output("self")), "`self` cannot be an output"),
        (nested(output("an\u0303o")), "cannot be an output"),
        (nested(output("Output")), "`Output` cannot be an output"),
        (nested(output(), output()), "a second output has the name `found`"),
        (nested(output(), "<input><name>found</name><type>bool</type><default>True</default></input>"),
         "`found` is an input already"),
        (nested(inside="found = False"), "the output `found` is also set by the variables"),
        (nested(output(type_name="long")), "the type of the output `found` must be one of int,"),
        (nested(output(default="1")), "the default of the output `found`: `1` is not of type bool"),
        (nested(output(default=None)), "the output `found` needs a default: its value until"),
    ],
)  # fmt: skip
def test_an_output_that_is_declared_wrong(tmp_path: Path, text: str, message: str) -> None:
    ((code, said),) = [each for each in found_in(tmp_path, text) if each[0][0] == "E"]
    assert code == "E528"
    assert message in said


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (nested(results=result("fuond")), "no automaton of state `search` has an output `fuond`"),
        (nested(results=result(child=3)), "automaton 3 has no output `found`"),
        (nested(results=result(child=9)), "state `search` does not own automaton 9"),
        (nested(results=result(), second=output()), 'have an output `found`: write `child="2"` or `child="3"`'),
        (nested(results=result() + result(variable="x"), variables="seen = x = 0 > 1"), "takes the output `found` twice"),
        (nested(output(), output("far"), results=result() + result("far"), code="found = far = True"),
         "state `search` takes two outputs into `seen`"),
        (nested(results=result(variable="sen")), "the automaton has no variable `sen` for the result"),
        (nested(results=result(variable="")), "the result names no variable"),
        (nested(results=result(variable="a b")), "the automaton has no variable `a b` for the result"),
        (nested(results=result(variable="near"),
                own="<input><name>near</name><type>bool</type><default>True</default></input>"),
         "`near` is an input, which the state above sets"),
        (nested(results=result(variable="said"), own=output("said", "str", '""')),
         "the output `said` is str, and takes `found`, which is bool"),
    ],
)  # fmt: skip
def test_a_result_that_is_wrong(tmp_path: Path, text: str, message: str) -> None:
    ((code, said),) = [each for each in found_in(tmp_path, text) if each[0][0] == "E"]
    assert code == "E529"
    assert message in said


@pytest.mark.parametrize(
    "text",
    [
        nested(),  # nobody has to take it
        nested(results=result()),
        nested(results=result(child=2)),
        nested(results=result(variable="here"), own=output("here")),  # which hands it on
        nested(results=result(variable="here"), own=output("here", "object", "None")),
        nested(output("n", "int", "0"), results=result("n", "x"), variables="x = 0.5", code="n = 1", above="print(x)"),
        nested(results=result(), variables="seen = None"),
        nested(output(type_name="object"), results=result(), code="found = 'yes'"),
        nested(results=result(), variables="", above="print(seen)\nseen_before = 1", own=transition(1, 1, 1, "seen = 1")).replace("seen = 1", "seen"),
        nested(code="self.helper(locals())"),
    ],
)  # fmt: skip
def test_nothing_is_said_of_what_is_right(tmp_path: Path, text: str) -> None:
    assert [each for each in found_in(tmp_path, text) if each[0] not in ("E529", "W524")] == []


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        (nested(code="print(1)"), "W536", "the output `found` is never assigned: it keeps its default"),
        (nested(results=result(), variables="seen = 'no'"), "W537",
         "`seen` begins as `'no'`, and takes the output `found`, which is bool"),
        (nested(results=result(), variables="seen = 3"), "W537", "`seen` begins as `3`"),
        (nested(results=result(), above="print(seen)\nseen = False"), "W538",
         "`seen` is overwritten in the next cycle: state `search` takes an output into it"),
    ],
)  # fmt: skip
def test_what_is_probably_a_mistake(tmp_path: Path, text: str, code: str, message: str) -> None:
    ((found, said),) = found_in(tmp_path, text)
    assert found == code
    assert said.startswith(message)


def test_a_variable_that_another_state_sets_is_no_mistake(tmp_path: Path) -> None:
    text = nested(results=result(), own=state(2, "before", "seen = False") + transition(1, 1, 2, "seen"))
    assert found_in(tmp_path, text) == []


def test_an_output_of_an_automaton_in_another_file_is_taken(tmp_path: Path) -> None:
    below = document(sub(1, 0, state(1, "look", "found = True", initial=True), output()))
    (tmp_path / "below.xml").write_text(below)
    owner = state(1, "search", "print(seen)", initial=True, child=2).replace(
        "</state>", f"{result()}</state>"
    )
    stub = "<SubAutomata id='2' idFather='1'><import>below.xml</import></SubAutomata>"
    assert found_in(tmp_path, document(sub(1, 0, owner, variables="seen = False"), stub)) == []
