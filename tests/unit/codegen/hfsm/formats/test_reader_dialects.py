"""Documents in old dialects become the same model, and nothing in them is lost."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document, write_document
from codegen.hfsm.document import Comment, Document, Element, Transition
from codegen.hfsm.formats.reader import Dialect, dialect_of
from codegen.hfsm.formats.xml_tree import parse_xml
from tests.support.document_comparison import differences
from tests.support.examples import examples

PATH = Path("old.xml")

SPANISH = """<?xml version="1.0"?>
<VisualHFSM>
<SubAutomata><idSub>1</idSub><idPadre>0</idPadre>
<Estado estado_inicial="true"><id>1</id><origenX>10</origenX><origenY>20.5</origenY><destinoX>50</destinoX>
<destinoY>60</destinoY><nombre>buscar pelota</nombre><hijo>4</hijo><codigo>a = 1
  b = 2 </codigo><transiciones>
<transicion><box x1="1" y1="2" x2="7" y2="8"/><nombre>vista</nombre><destino>2</destino><codigo>a &lt; b</codigo></transicion>
<transicion><box x1="3" y1="4" x2="9" y2="10"/><nombre></nombre><destino>1</destino><tiempo>500</tiempo></transicion>
</transiciones></Estado>
<Estado estado_inicial="false"><id>2</id><origenX>1</origenX><origenY>2</origenY><destinoX>3</destinoX><destinoY>4</destinoY>
<nombre></nombre><hijo>0</hijo><codigo></codigo><transiciones/></Estado>
<tiempoIteracion>175</tiempoIteracion><Librerias><lib>laser</lib><lib>motor</lib></Librerias>
<variables_aux>a = 0</variables_aux><funciones_aux>def f(self): pass</funciones_aux></SubAutomata>
<SubAutomata><idSub>4</idSub><idPadre>1</idPadre>
<Estado estado_inicial="false"><id>1</id><nombre>x</nombre><hijo>9</hijo><codigo/><transiciones>
<transicion><nombre/><destino>1</destino></transicion></transiciones></Estado>
<Librerias><lib>motor</lib><lib>radar</lib></Librerias></SubAutomata>
<nombreEsquema>/home/someone/esquema</nombreEsquema>
</VisualHFSM>
"""

VISUALSTATES = """<?xml version="1.0" ?>
<VisualStates>
  <config type="1">
    <buildDependencies><dependency>rospy</dependency></buildDependencies>
    <topics><topic id="0"><name>/scan</name><type>sensor_msgs/LaserScan</type><opType>Subscribe</opType></topic></topics>
  </config>
  <global_namespace><functions></functions><variables></variables></global_namespace>
  <libraries><library>math</library></libraries>
  <state id="0" initial="True">
    <posx>0.0</posx><posy>0.0</posy><name>root</name><code></code><timestep>50</timestep>
    <namespace>
      <functions>def near(self):
\treturn self.distance &lt; 1</functions>
      <variables>self.distance = 2</variables>
      <parameters>
        <param type="Float" name="speed"><value>0.5</value><description>how fast</description></param>
        <param type="String" name="greeting"><value>it's me</value><description></description></param>
        <param type="Boolean" name="loud"><value>true</value><description></description></param>
        <param type="Quaternion" name="pose"><value>1</value><description></description></param>
      </parameters>
    </namespace>
    <state id="3" initial="true">
      <posx>845.5</posx><posy>970.0</posy><name>search</name><code>self.look()</code><timestep>200</timestep>
      <namespace><functions></functions><variables>self.seen = False</variables></namespace>
      <transition id="9">
        <type>1</type><condition>self.turn()
return self.near()</condition><posx>1.0</posx><posy>2.0</posy><name>found</name>
        <originid>3</originid><destinationid>7</destinationid><code>x = 1</code>
      </transition>
      <state id="5" initial="TRUE"><posx>1</posx><posy>2</posy><name>left</name><code></code><timestep>30</timestep>
        <transition id="2"><type>0</type><time>1500</time><posx>0</posx><posy>0</posy><name></name>
          <originid>5</originid><destinationid>5</destinationid><code></code></transition>
      </state>
    </state>
    <state id="7" initial="False">
      <posx>1</posx><posy>2</posy><name>follow</name><code></code><timestep>50</timestep>
    </state>
  </state>
</VisualStates>
"""


def read(text: str) -> tuple[Document, list[str]]:
    """Return the document and what was found and remarked, each as code and message."""
    diagnostics = Diagnostics()
    document = parse_document(text, PATH, diagnostics, remarks=diagnostics)
    assert document is not None, diagnostics.render()
    return document, [f"{found.code}: {found.message}" for found in diagnostics]


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


def in_spanish(inside: str) -> Document:
    head = "<VisualHFSM><SubAutomata><idSub>1</idSub>"
    return read(f"{head}{inside}</SubAutomata></VisualHFSM>")[0]


def in_states(inside: str, before: str = "") -> Document:
    """Return a document of VisualStates with these states in its outermost."""
    return read(
        f'<VisualStates>{before}<state id="0" initial="True"><name>root</name>{inside}</state></VisualStates>'
    )[0]


@pytest.mark.parametrize(
    ("text", "dialect"),
    [
        (SPANISH, Dialect.SPANISH),
        ("<VisualStates><SubAutomata><Estado/></SubAutomata></VisualStates>", Dialect.SPANISH),
        ("<VisualHFSM><nombreEsquema/></VisualHFSM>", Dialect.SPANISH),
        (VISUALSTATES, Dialect.VISUALSTATES),
        ("<VisualHFSM><state/></VisualHFSM>", Dialect.VISUALSTATES),
        ("<VisualStates><functions/></VisualStates>", Dialect.VISUALSTATES),
        ("<VisualStates><SubAutomata id='1'/></VisualStates>", Dialect.NATIVE),
        ("<VisualHFSM><SubAutomata id='1'/><state/></VisualHFSM>", Dialect.NATIVE),
        ("<VisualHFSM/>", Dialect.NATIVE),
        ("<VisualStates><config/></VisualStates>", Dialect.NATIVE),
    ],
)  # fmt: skip
def test_the_dialect_is_recognized_by_the_children_not_by_the_root(text: str, dialect: Dialect) -> None:
    root = parse_xml(text.encode(), PATH, Diagnostics())
    assert root is not None
    assert dialect_of(root) is dialect


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


def test_reads_the_automata_of_2013() -> None:
    document, found = read(SPANISH)
    root, child = document.automata
    assert (root.id, root.father, child.id, child.father) == (1, 0, 4, 1)
    assert (root.iteration_time.text, child.iteration_time.text) == ("175", "100")
    assert (root.variables.text, root.functions.text) == ("a = 0", "def f(self): pass")
    state = root.states[0]
    assert (state.id, state.name, state.initial, state.x, state.y) == (1, "buscar pelota", True, 10.0, 20.5)
    assert (state.children, state.code.text) == ((4,), "a = 1\n  b = 2 ")
    assert [library.name.text for library in document.libraries] == ["laser", "motor", "radar"]
    assert {library.kind for library in document.libraries} == {"driver"}
    assert child.states[0].children == (9,)
    assert [message[:4] for message in found] == ["N501"] * 5


def test_reads_the_transitions_of_2013() -> None:
    document, _ = read(SPANISH)
    first, second = document.automata[0].transitions
    assert _shape(first) == (1, "vista", 1, 2, "condition", "a < b", 1.0, 2.0)
    assert _shape(second) == (2, "", 1, 1, "time", "500", 3.0, 4.0)
    (without,) = document.automata[1].transitions
    assert _shape(without) == (1, "", 1, 1, "condition", "", 0.0, 0.0)
    assert first.extras == (Element("box", (("x1", "1"), ("y1", "2"), ("x2", "7"), ("y2", "8"))),)


def _shape(transition: Transition) -> tuple[object, ...]:
    ends = (transition.origin, transition.destination)
    place = (transition.x, transition.y)
    return (transition.id, transition.name, *ends, transition.type, transition.trigger.text, *place)


def test_an_automaton_of_2013_that_names_no_father_belongs_to_the_state_that_names_it() -> None:
    document, found = read(SPANISH.replace("<idPadre>1</idPadre>", ""))
    assert document.automata[1].father == 1
    assert any(message.startswith("W502") for message in found)


def test_a_condition_beside_a_time_is_kept() -> None:
    document = in_spanish(
        "<Estado><id>1</id><transiciones><transicion><destino>1</destino><codigo>c</codigo><tiempo>5</tiempo>"
        "</transicion></transiciones></Estado>"
    )
    (transition,) = document.automata[0].transitions
    assert (transition.type, transition.trigger.text) == ("time", "5")
    assert transition.extras == (Element("codigo", (), "c"),)


def test_an_unknown_element_with_a_native_name_does_not_become_what_it_is_called() -> None:
    document = in_spanish(
        "<Estado><id>1</id><entry>x</entry><final>true</final></Estado><functions>y</functions>"
    )
    again, _ = read(write_document(document))
    assert again == document
    (state,) = again.automata[0].states
    assert (state.entry.text, state.final, again.automata[0].functions.text) == ("", False, "")
    assert state.extras[0] == Element("kept", children=(Element("entry", (), "x"),))


def test_comments_and_unknown_elements_of_2013_survive() -> None:
    text = (
        "<VisualHFSM><SubAutomata><!-- a --><idSub>1</idSub><Estado color='red'><id nota='b'>1</id><!-- c --><nombre>n</nombre>"
        "<transiciones orden='d'><!-- e --><transicion f='g'><destino>1</destino></transicion><!-- h --><otro>i</otro>"
        "</transiciones></Estado></SubAutomata></VisualHFSM>"
    )
    document, found = read(text)
    written = write_document(document)
    again, _ = read(written)
    assert again == document
    for piece in (*(f"<!-- {each} -->" for each in "aceh"), 'f="g"', "<otro>i</otro>"):
        assert written.count(piece) == 1, piece
    assert [message for message in found if message.startswith("W501")] == [
        "W501: attributes of `id` are lost on saving",
        "W501: attributes of `transiciones` are lost on saving",
    ]


# VisualStates


def test_reads_the_automata_of_visualstates() -> None:
    document, _ = read(VISUALSTATES)
    assert document.root_tag == "VisualHFSM"
    root, child = document.automata
    # An automaton's id is that of its owner and one, so that it stays when something is drawn elsewhere.
    assert (root.id, root.father, child.id, child.father) == (1, 0, 4, 1)
    assert (root.iteration_time.text, child.iteration_time.text) == ("50", "200")
    search, follow = root.states
    assert (search.id, search.name, search.initial, search.x, search.children) == (
        3,
        "search",
        True,
        845.5,
        (4,),
    )
    assert (search.history.text, follow.history.text) == ("restart", "")
    assert root.functions.text == "def near(self):\n\treturn self.distance < 1"
    assert (root.variables.text, child.variables.text) == ("self.distance = 2", "self.seen = False")
    assert [library.name.text for library in document.libraries] == ["math"]
    # What stands in the automaton stands there alone.
    assert search.extras == ()
    assert write_document(document).count("self.seen = False") == 1


def test_reads_the_transitions_of_visualstates() -> None:
    document, _ = read(VISUALSTATES)
    root, child = document.automata
    assert [_shape(each) for each in root.transitions] == [
        (9, "found", 3, 7, "condition", "self.turn()\nreturn self.near()", 1.0, 2.0)
    ]
    assert [_shape(each) for each in child.transitions] == [(2, "", 5, 5, "time", "1500", 0.0, 0.0)]
    assert root.transitions[0].code.text == "x = 1"


def test_parameters_of_namespaces_become_those_of_the_component() -> None:
    document, found = read(VISUALSTATES)
    assert [(each.name, each.type.text, each.default.text) for each in document.parameters] == [
        ("speed", "float", "0.5"),
        ("greeting", "str", '"it\'s me"'),
        ("loud", "bool", "True"),
    ]
    assert document.parameters[0].description.text == "how fast"
    assert "N501: the parameter `pose` is kept, but not used" in found


def test_what_has_no_word_here_is_kept_and_reported() -> None:
    document, found = read(VISUALSTATES)
    (pseudo,) = [extra for extra in document.extras if isinstance(extra, Element)]
    assert (pseudo.tag, pseudo.attributes) == ("pseudostate", (("id", "0"), ("initial", "True")))
    (config,) = document.lists
    assert (config.tag, config.attributes) == ("config", (("type", "1"),))
    assert [each.tag for each in config.children if isinstance(each, Element)] == ["buildDependencies"]
    left = document.automata[1].states[0]
    assert left.extras == (Element("timestep", (), "30"),)
    reported = "\n".join(found)
    for words in ("`buildDependencies`", "`timestep` of a state without inner states"):
        assert words in reported


def test_topics_of_visualstates_become_interfaces_of_ros() -> None:
    published = (
        "<topic id='1'><name>/cmd_vel</name><type>geometry_msgs/Twist</type><opType>Publish</opType>"
        "<methodname>drive</methodname></topic>"
    )
    document, _ = read(VISUALSTATES.replace("<topics>", f"<topics>{published}"))
    found = [(each.kind, each.name, each.target, each.type) for each in document.ros]
    assert found == [
        ("publish", "drivePub", "/cmd_vel", "geometry_msgs/msg/Twist"),
        ("subscribe", "scanSub", "/scan", "sensor_msgs/msg/LaserScan"),
    ]
    aliases = {name: (*alias,) for name, alias in document.ros_aliases.items()}
    drive = ("drivePub", "publish")
    assert aliases == {"publishdrive": drive, "drive": drive, "scan": ("scanSub", "value")}


def test_comments_and_unknown_elements_of_visualstates_survive() -> None:
    text = (
        "<VisualStates><!-- a --><config type='0'><!-- b --><interfaces><!-- c --><interface><name>m</name><!-- d --></interface>"
        "<!-- e --></interfaces><other>f</other></config><!-- g --><libraries><!-- h --><lib>x</lib></libraries><!-- i --><state id='0'>"
        "<!-- j --><functions>def k(self): pass</functions><!-- l --><timestep>50</timestep><!-- m --><namespace><variables>n = 1</variables>"
        "</namespace><!-- o --><state id='1'><!-- p --><name>q</name><!-- r --><code>s = 1</code><!-- t --><transition id='1'><!-- u -->"
        "<type>1</type><destinationid>1</destinationid><v>w</v></transition><!-- x --></state><!-- y --></state><!-- z --></VisualStates>"
    )
    document, found = read(text)
    written = write_document(document)
    again, _ = read(written)
    assert again == document
    for piece in (*(f"<!-- {each} -->" for each in "abcdeghijlmoprtuxyz"), "<other>f</other>", "<v>w</v>"):
        assert written.count(piece) == 1, piece
    assert not [message for message in found if message.startswith("W501")]
    assert document.automata[0].comments == (Comment(" i "),)
    assert document.automata[0].states[0].comments == (Comment(" o "),)
    assert document.automata[0].transitions[0].comments == (Comment(" t "),)


@pytest.mark.parametrize(
    "inside",
    [
        "<timestep lost='a'>5</timestep>",
        "<functions lost='a'>def f(self): pass</functions>",
        "<namespace><variables lost='a'>x = 1</variables></namespace>",
        "<state id='1'><name lost='a'>n</name></state>",
        "<state id='1'><transition id='1'><type lost='a'>1</type><destinationid>1</destinationid></transition></state>",
    ],
)
def test_attributes_of_values_of_visualstates_are_lost_and_that_is_reported(inside: str) -> None:
    _, found = read(f"<VisualStates><state id='0'>{inside}</state></VisualStates>")
    assert [message[:4] for message in found] == ["W501"]


def test_functions_of_the_component_and_of_states_come_to_their_automaton() -> None:
    document = in_states(
        "<functions>def b(self): pass</functions>"
        "<state id='1'><name>s</name><functions>def c(self): pass</functions><variables> </variables></state>",
        before="<functions>def a(self): pass\n</functions><variables>self.x = 1</variables>",
    )
    (root,) = document.automata
    assert root.functions.text == "def a(self): pass\ndef b(self): pass\ndef c(self): pass"
    assert root.variables.text == "self.x = 1"
    assert [extra.tag for extra in document.extras if isinstance(extra, Element)] == ["pseudostate"]
    assert root.states[0].extras == ()


def test_the_namespace_of_a_state_without_states_is_kept_and_not_used() -> None:
    document = in_states(
        "<state id='1'><namespace><functions>def f(self): pass</functions></namespace></state>"
    )
    (root,) = document.automata
    assert root.functions.text == ""
    assert root.states[0].extras == (
        Element("namespace", (), "", (Element("functions", (), "def f(self): pass"),)),
    )


@pytest.mark.parametrize(
    "config",
    [
        "<configs><config><name>m</name><proxyname>Motors</proxyname><ip>here</ip><port>1</port><interface>M</interface></config></configs>",
        """<config type='0'><interfaces><interface><serverType>ice</serverType><name>m</name><topic>/t</topic>
        <proxyName>Motors</proxyName><ip>here</ip><port>1</port><interfaceName>M</interfaceName></interface></interfaces></config>""",
    ],
)
def test_interfaces_of_both_forms_are_read(config: str) -> None:
    document = in_states("", before=config)
    (interface,) = document.interfaces
    assert (interface.name, interface.proxy, interface.ip, interface.port, interface.type) == (
        "m", "Motors", "here", "1", "M",
    )  # fmt: skip
    again, _ = read(write_document(document))
    assert again == document


def test_states_of_one_id_in_different_states_are_distinguished() -> None:
    document = in_states(
        "<state id='1'><transition id='1'><type>0</type><time>5</time><originid>1</originid><destinationid>2</destinationid></transition>"
        "<state id='1'><state id='8'/></state><state id='2'/></state><state id='2'/>"
    )
    assert [[state.id for state in each.states] for each in document.automata] == [[1, 2], [1, 2], [8]]
    assert [(each.id, each.father) for each in document.automata] == [(1, 0), (2, 1), (3, 2)]
    assert [len(each.transitions) for each in document.automata] == [1, 0, 0]


def test_the_largest_id_leaves_room_for_the_automaton() -> None:
    document = in_states(f"<state id='{2**31 - 1}'><state id='1'/></state>")
    assert [each.id for each in document.automata] == [1, 2]
    assert read(write_document(document))[0] == document


def test_a_transition_that_stands_around_the_state_that_it_leaves_is_found() -> None:
    document = in_states(
        "<transition id='1'><type>0</type><time>5</time><originid>2</originid><destinationid>2</destinationid></transition>"
        "<state id='2'><transition id='2'><type>1</type><condition>c</condition><originid>3</originid><destinationid>3</destinationid></transition>"
        "<state id='3'/></state>"
    )
    assert [[each.id for each in automaton.transitions] for automaton in document.automata] == [[1], [2]]


@pytest.mark.parametrize(
    ("inside", "expected"),
    [
        ("<type>1</type><condition>c</condition><time>5</time>", ("condition", "c")),
        ("<type> 0 </type><time> 5 </time>", ("time", " 5 ")),
        ("<time>5</time>", ("time", "5")),
        ("<condition>c</condition>", ("condition", "c")),
        ("<type></type>", ("condition", "")),
        ("<type>later</type><condition>c</condition>", ("later", "c")),
    ],
)
def test_the_trigger_is_understood_where_it_can_be(inside: str, expected: tuple[str, str]) -> None:
    document = in_states(
        f"<state id='1'><transition id='1'>{inside}<destinationid>1</destinationid></transition></state>"
    )
    (transition,) = document.automata[0].transitions
    assert (transition.type, transition.trigger.text) == expected
    assert (transition.origin, transition.destination) == (1, 1)


def test_several_outermost_states_are_those_of_the_root() -> None:
    document, found = read(
        "<VisualStates><state id='4'/><state id='5'><state id='6'/></state></VisualStates>"
    )
    assert [[state.id for state in each.states] for each in document.automata] == [[4, 5], [6]]
    assert found[0].startswith("W505")


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


@settings(max_examples=examples(40), deadline=None)
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


@settings(max_examples=examples(40), deadline=None)
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
