"""Documents of VisualStates."""

from __future__ import annotations

import pytest

from codegen.hfsm import write_document
from codegen.hfsm.document import Comment, Element
from plugins.old_documents.tests.support.old_dialects import VISUALSTATES, in_states, read, shape


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
    assert [shape(each) for each in root.transitions] == [
        (9, "found", 3, 7, "condition", "self.turn()\nreturn self.near()", 1.0, 2.0)
    ]
    assert [shape(each) for each in child.transitions] == [(2, "", 5, 5, "time", "1500", 0.0, 0.0)]
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
