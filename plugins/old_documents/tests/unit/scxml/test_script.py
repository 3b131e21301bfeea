"""Texts and attributes of SCXML become valid Python with the same meaning, or are reported."""

from __future__ import annotations

import ast

import pytest

from codegen.hfsm.code.text import parse_piece
from plugins.old_documents.tests.support.scxml_documents import import_, scxml

PYTHON = ' datamodel="python"'


def reported(text: str) -> list[str]:
    document, found = import_(scxml(text, PYTHON))
    assert document is not None, found.render()
    return sorted(each.code for each in found)


def read(text: str) -> str:
    """Return the variables and the entry code of the state `a`."""
    document, found = import_(scxml(text, PYTHON))
    assert document is not None, found.render()
    root = document.automata[0]
    return "\n".join(filter(None, (root.variables.text, root.states[0].entry.text)))


def data(text: str) -> object:
    """Return the value that data with a text inside has."""
    name, _, value = read(f'<datamodel><data id="x">{text}</data></datamodel><state id="a"/>').partition(
        " = "
    )
    assert name == "x"
    return ast.literal_eval(value)


@pytest.mark.parametrize(
    ("text", "value", "codes"),
    [
        ("\n  [1, 2, 3]\n", [1, 2, 3], []),
        ("\n  {'a': [1,\n 2]}\n", {"a": [1, 2]}, []),
        ("\n  1 +\n 2j\n", 1 + 2j, []),
        ("1 # one", 1, []),
        ('{"a": true,\n "b": null}', {"a": True, "b": None}, []),
        ('"so true"', "so true", []),
        # B.2.1 of the Recommendation: what is neither an object nor XML is a text whose spaces are normalized.
        ("\nthis  is \na text\n", "this is a text", ["N561"]),
        ("\n [1, 2\n", "[1, 2", ["N561"]),
        ('["null", null]', ["null", None], []),
        ("[" * 300 + "null" + "]" * 300, "[" * 300 + "null" + "]" * 300, ["N561"]),
        (")+(", ")+(", ["N561"]),
        ("1)(2", "1)(2", ["N561"]),
        ("x for x in y", "x for x in y", ["N561"]),
        ("# nothing", "# nothing", ["N561"]),
        ("\\", "\\", ["N561"]),
        ("  ", None, []),
        ("<book/>", None, ["W561"]),
    ],
)
def test_data_may_stand_on_lines_of_its_own(text: str, value: object, codes: list[str]) -> None:
    assert data(text) == value
    assert reported(f'<datamodel><data id="x">{text}</data></datamodel><state id="a"/>') == codes


@pytest.mark.parametrize(
    "element",
    [
        '<assign location="x" expr="{}"/>',
        '<log label="x" expr="{}"/>',
        '<send event="e"><param name="x" expr="{}"/></send>',
        '<if cond="{}"><log label="x"/></if>',
    ],
)
@pytest.mark.parametrize("expression", ["1", " 1 ", "1 +&#10; 2", "1, 2", "1 # one", "(y := 1)"])
def test_an_expression_means_the_same_wherever_it_stands(element: str, expression: str) -> None:
    code = read(f'<state id="a"><onentry>{element.format(expression)}</onentry></state>')
    plain = expression.strip().replace("&#10;", "\n")
    tree = parse_piece(code)
    assert tree is not None, code
    assert ast.dump(ast.parse(f"({plain}\n)", mode="eval").body) in ast.dump(tree)


@pytest.mark.parametrize(
    ("element", "code"),
    [
        ('<assign location="x" expr="return"/>', ""),
        ('<assign location="x" expr="y = 1"/>', ""),
        ('<assign location="x" expr="yield y"/>', ""),
        ('<assign location="x" expr="*y"/>', ""),
        ('<log label="x" expr="1 1"/>', 'self.log.info("%s", "x")'),
        ('<send event="e"><param name="x" expr="="/></send>', 'self.send("e")'),
        ('<if cond="=="><log label="x"/></if>', 'if False:\n    self.log.info("%s", "x")'),
    ],
)
def test_what_is_no_expression_is_reported(element: str, code: str) -> None:
    text = f'<state id="a"><onentry>{element}</onentry></state>'
    assert read(text) == code
    assert reported(text) == ["W561"]


def test_a_condition_that_is_no_python_never_holds() -> None:
    document, found = import_(scxml('<state id="a"><transition cond="= 1" target="a"/></state>', PYTHON))
    assert document is not None
    assert document.automata[0].transitions[0].trigger.text == "False"
    assert [each.code for each in found] == ["W561"]


@pytest.mark.parametrize(
    ("script", "codes"),
    [
        ("print 1", ["N502"]),
        ("(", ["N502"]),
        ('\n    x = """\nup to the margin"""\n    if x:\n        pass\n  ', []),
        ("", []),
    ],
)
def test_a_script_that_is_no_python_is_kept_and_reported(script: str, codes: list[str]) -> None:
    text = f'<state id="a"><onentry><script>{script}</script></onentry></state>'
    assert read(text) == script
    assert reported(text) == codes
    assert reported(text.replace("<onentry>", '<onentry><log label="x"/>')) == codes


def test_a_branch_may_have_strings_of_several_lines_or_no_statement() -> None:
    script = '\n    text = """\n keep\n      this\n"""\n    n = 1\n  '
    code = read(
        '<state id="a"><onentry><if cond="True"><log label="x"/><if cond="True"><script>'
        f"{script}</script><else/><script># nothing</script></if></if></onentry></state>"
    )
    values: dict[str, object] = {"self": type("Self", (), {"log": type("Log", (), {"info": print})})}
    exec(code, values)
    assert (values["text"], values["n"]) == ("\n keep\n      this\n", 1)


def test_an_event_has_the_data_that_scxml_gives_it() -> None:
    entry = '<send event="e" namelist="x y"><param name="z" location="y"/></send><send event="f"><content>12</content></send>'
    assert read(f'<state id="a"><onentry>{entry}</onentry></state>').splitlines() == [
        'self.send("e", {"x": x, "y": y, "z": y})',
        'self.send("f", 12)',
    ]


@pytest.mark.parametrize(
    ("first", "second", "codes"),
    [
        ('<send event="e"/>', '<raise event="f"/>', ["W562"]),
        ('<send event="e"/>', '<if cond="1"><send event="f" target="#_internal"/></if>', ["W562"]),
        ('<raise event="f"/>', '<send event="e"/>', []),
        ('<send event="e"/>', '<send event="f"/>', []),
        ('<send event="e" delay="1s"/>', '<raise event="f"/>', ["W561"]),
    ],
)
def test_events_that_scxml_takes_in_another_order_are_reported(
    first: str, second: str, codes: list[str]
) -> None:
    assert reported(f'<state id="a"><onentry>{first}</onentry><onentry>{second}</onentry></state>') == codes


@pytest.mark.parametrize(
    ("elsewhere", "codes"),
    [
        ('<state id="b"><transition event="e" target="b"><send event="e"/></transition></state>', ["W562"]),
        (
            '<s:state xmlns:s="http://www.w3.org/2005/07/scxml"><s:onexit><s:send event="e"/></s:onexit></s:state>',
            ["W562"],
        ),
        ('<state id="b"><onentry><send event="e" delay="1s"/></onentry></state>', ["W561"]),
        ('<state id="b"><onentry><send event="e" type="http"/></onentry></state>', ["W561"]),
        ('<state id="b"><onentry><send event="e" target="#_internal"/></onentry></state>', []),
        ('<state id="b"><onentry><raise event="e"/></onentry></state>', []),
    ],
)
def test_a_raised_event_is_reported_where_the_chart_also_sends_others(
    elsewhere: str, codes: list[str]
) -> None:
    assert reported(f'<state id="a"><onentry><raise event="f"/></onentry></state>{elsewhere}') == codes


def test_an_event_for_the_chart_itself_may_say_so() -> None:
    of_scxml = "http://www.w3.org/TR/scxml/#SCXMLEventProcessor"
    for attribute in ('type="scxml"', f'type="{of_scxml}"', 'q:note="x" xmlns:q="urn:q"'):
        code = read(f'<state id="a"><onentry><send event="e" {attribute}/></onentry></state>')
        assert code == 'self.send("e")'


@pytest.mark.parametrize(
    ("elements", "codes"),
    [
        ('<transition event="go" target="p"><raise event="x"/></transition>', ["W562"]),
        ('<transition event="go" target="p"><if cond="1"><raise event="x.y"/></if></transition>', ["W562"]),
        ('<onexit><raise event="x"/></onexit><transition event="go" target="p"/>', ["W562"]),
        ('<transition event="go" target="p"><send event="x" delay="1s"/></transition>', ["W561"]),
        ('<transition event="go" target="p"><raise event="xy"/></transition>', []),
        ('<transition event="go" target="p"><raise event="out"/></transition>', []),
        ('<transition event="go" target="a"><raise event="x"/></transition>', []),
    ],
)
def test_an_event_that_is_sent_before_the_automaton_that_waits_for_it_starts_is_reported(
    elements: str, codes: list[str]
) -> None:
    inside = '<state id="p"><transition event="out" target="a"/><state id="b"><transition event="x" target="c"/></state>'
    assert reported(f'<state id="a">{elements}</state>{inside}<state id="c"/></state>') == codes


@pytest.mark.parametrize(("event", "codes"), [("x", ["W562"]), ("y", []), ("z", [])])
def test_entry_code_is_not_heard_inside_its_state(event: str, codes: list[str]) -> None:
    region = '<state id="r"><transition event="x" target="r"/><onentry><raise event="y"/></onentry></state>'
    entry = f'<onentry><raise event="{event}"/></onentry><transition event="z" target="p"/>'
    assert reported(f'<parallel id="p">{entry}{region}</parallel>') == codes


@pytest.mark.parametrize(
    "attribute", ['type="http"', 'targetexpr="x"', 'idlocation="x"', 'target="#_parent"']
)
def test_a_delayed_event_for_others_or_that_is_computed_is_no_timer(attribute: str) -> None:
    entry = f'<onentry><send event="late" id="t" delay="1s" {attribute}/></onentry>'
    exit_ = '<onexit><cancel sendid="t"/></onexit><transition event="late" target="a"/>'
    assert reported(f'<state id="a">{entry}{exit_}</state>') == ["W561", "W561"]


def test_a_state_may_have_several_timers() -> None:
    inside = "".join(
        f'<onentry><send event="{event}" id="{event}" delay="{event[1]}s"/></onentry><onexit><cancel sendid="{event}"/>'
        f'</onexit><transition event="{event}" target="a"/>'
        for event in ("t1", "t2")
    )
    document, found = import_(scxml(f'<state id="a">{inside}</state>', PYTHON))
    assert document is not None
    assert [each.trigger.text for each in document.automata[0].transitions] == ["1000", "2000"]
    assert not len(found)


def test_elements_of_other_programs_may_have_any_attribute() -> None:
    assert "W561" not in reported('<state id="a"><q:layout xmlns:q="urn:q" left="1"/></state>')


def test_a_timer_may_be_awaited_with_a_star() -> None:
    entry = '<onentry><send event="late" id="t" delay="1s"/></onentry><onexit><cancel sendid="t"/></onexit>'
    document, _ = import_(
        scxml(f'<state id="a">{entry}<transition event="late.*" target="a"/></state>', PYTHON)
    )
    assert document is not None
    assert [each.trigger.text for each in document.automata[0].transitions] == ["1000"]


def test_an_internal_transition_that_leaves_its_state_is_like_any_other() -> None:
    assert (
        reported('<state id="a"><transition type="internal" event="e" target="b"/></state><state id="b"/>')
        == []
    )


def test_an_event_without_delay_is_sent_at_once() -> None:
    assert read('<state id="a"><onentry><send event="e" delay="0s"/></onentry></state>') == 'self.send("e")'


@pytest.mark.parametrize(("attribute", "word"), [('src="d.json"', "another file"), ('id="1"', "variable")])
def test_data_that_is_not_imported_says_why(attribute: str, word: str) -> None:
    id_ = "" if attribute.startswith("id") else 'id="limits" '
    _, found = import_(scxml(f'<datamodel><data {id_}{attribute}/></datamodel><state id="a"/>', PYTHON))
    assert word in found.render()


@pytest.mark.parametrize(("binding", "codes"), [("early", []), ("late", ["W562"])])
def test_data_that_is_set_when_its_state_is_entered_is_reported(binding: str, codes: list[str]) -> None:
    inside = '<state id="a"><datamodel><data id="x" expr="1"/></datamodel></state>'
    _, found = import_(scxml(inside, f'{PYTHON} binding="{binding}"'))
    assert [each.code for each in found] == codes
