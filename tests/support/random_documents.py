"""Random documents: anything that a person types, and anything that another program adds."""

from __future__ import annotations

from hypothesis import strategies as st

from codegen.hfsm.document import (
    Annotation,
    Argument,
    Automaton,
    Comment,
    Document,
    Element,
    Event,
    Import,
    Interface,
    Library,
    Parameter,
    Property,
    Result,
    Shelf,
    State,
    Survives,
    Text,
    Transition,
)

# Each draw takes time, and a document needs hundreds: there are few choices, and most fields are empty.
_WHITE = "\t\n\r\x85\u2028"
_AWKWARD = [
    "",
    "x",
    " ",
    "\n",
    "\r\n",
    "\n  a = 1\n\tb\n",
    "]]>",
    "a<b>&amp;c",
    "\"'",
    "\x7f\x85",
    "ñ\u2028",
    "\U0010ffff",
]
texts = st.sampled_from(_AWKWARD) | st.text(
    st.characters(
        exclude_categories=["Cs", "Cc"], exclude_characters="\ufffe\uffff", include_characters=_WHITE
    ),
    max_size=8,
)
code = texts.map(Text)
ids = st.integers(0, 2**31 - 1)
numbers = st.floats(allow_nan=False, allow_infinity=False)
tags = st.sampled_from(["xa", "xB", "xlonger"])


def _seldom(strategy):
    """Return nothing most of the time, for fields that are rarely used."""
    return st.one_of(st.just(()), st.just(()), strategy)


def _at_most_two(strategy):
    return st.one_of(st.just(()), st.tuples(strategy), st.tuples(strategy, strategy))


comments = _seldom(_at_most_two(st.sampled_from(["", "a", " <&>\n "]).map(Comment)))
attributes = _seldom(
    st.tuples(st.tuples(st.just("xa"), texts))
    | st.tuples(st.tuples(st.just("xb"), texts), st.tuples(st.just("xa"), texts))
)
_small = st.builds(Element, tags, attributes, texts)
_large = st.builds(Element, tags, attributes, st.just(""), st.tuples(_small, _small))
elements = _small | st.builds(Element, tags, attributes, st.just(""), st.tuples(_small | _large)) | _large
extras = _seldom(_at_most_two(elements))


_list_elements = st.builds(
    Element, st.sampled_from(["parameters", "events", "libraries", "config"]), attributes, st.just(""), extras
).filter(lambda each: each.attributes or each.children)
_LISTS = ["parameters", "events", "properties", "libraries", "config"]
lists = _seldom(
    st.lists(_list_elements, max_size=2, unique_by=lambda each: each.tag).map(
        lambda found: tuple(sorted(found, key=lambda each: _LISTS.index(each.tag)))
    )
)


node = {"comments": comments, "extras": extras, "attributes": attributes}
arguments = st.builds(Argument, name=texts, child=ids, value=code, comments=comments, attributes=attributes)
results = st.builds(Result, name=texts, child=ids, variable=code, comments=comments, attributes=attributes)
parameters = st.lists(
    st.builds(Parameter, name=texts, type=code, default=code, description=code, **node), max_size=2
).map(tuple)
imports = st.none() | st.builds(Import, file=code, automaton=ids)
states = st.builds(
    State,
    id=ids,
    name=texts,
    initial=st.booleans(),
    x=numbers,
    y=numbers,
    final=st.booleans(),
    children=st.lists(st.integers(1, 2**31 - 1), max_size=2).map(tuple),
    history=code,
    entry=code,
    code=code,
    exit=code,
    arguments=st.lists(arguments, max_size=1).map(tuple),
    results=st.lists(results, max_size=1).map(tuple),
    **node,
)
transitions = st.builds(
    Transition, id=ids, name=texts, x=numbers, y=numbers, origin=ids, destination=ids,
    type=texts, trigger=code, guard=code, priority=code, code=code, **node,
)  # fmt: skip
written = st.lists(
    st.builds(
        Annotation, id=st.integers(1, 2**31 - 1), kind=st.sampled_from(["note", "frame", "", "later"]), x=numbers, y=numbers,
        width=numbers, height=numbers, color=code, text=code, **node,
    ), max_size=2, unique_by=lambda each: each.id,
).map(tuple)  # fmt: skip
automata = st.builds(
    Automaton, id=ids, father=ids, states=st.lists(states, max_size=2).map(tuple),
    transitions=st.lists(transitions, max_size=2).map(tuple), annotations=written, inputs=parameters, outputs=parameters,
    imported=imports, iteration_time=code, variables=code,
    functions=code, **node,
)  # fmt: skip
interfaces = st.builds(
    Interface, name=texts, proxy=st.none() | texts, ip=st.none() | texts, port=st.none() | texts,
    type=texts, **node,
)  # fmt: skip
libraries = st.builds(Library, name=code, comments=comments, attributes=attributes)


shelves = st.none() | st.builds(Shelf, title=code, category=code, icon=code, words=code, **node)
documents = st.builds(
    Document, root_tag=st.sampled_from(["VisualHFSM", "VisualStates"]), description=code, on_error=code, on_refused=code,
    world=code, language=code, shelf=shelves, parameters=parameters, events=st.lists(st.builds(Event, name=texts, description=code, **node), max_size=2).map(tuple),
    properties=st.lists(
        st.builds(Property, name=texts, kind=texts, within=code, expression=code, **node), max_size=2
    ).map(tuple), survives=st.lists(
        st.builds(Survives, part=texts, kind=texts, amount=texts, after=texts, must=texts, **node), max_size=2
    ).map(tuple), automata=st.lists(automata, max_size=2).map(tuple), libraries=st.lists(libraries, max_size=2).map(tuple),
    interfaces=st.lists(interfaces, max_size=2).map(tuple), lists=lists, **node,
)  # fmt: skip

# Documents whose parts find each other, most of the time, and whose names mean something elsewhere.
_few_ids = st.integers(0, 4)
_names = st.sampled_from(["a", "b", "go home", "state", "wait_2", "", "ñ", "a.b", "1", "hfsm"])
_awkward_extras = st.lists(
    st.builds(
        Element,
        st.sampled_from(["xa", "a:b", "hfsm:code", "script", "native-state", "a_x003A_b"]),
        st.dictionaries(st.sampled_from(["a", "a:b", "xmlns", "xmlns:z", "_x005F_"]), texts, max_size=2).map(
            lambda found: tuple(found.items())
        ),
        st.sampled_from(["", "text", " \n"]),
    ),
    max_size=2,
).map(tuple)
_awkward = {"comments": comments, "extras": _awkward_extras, "attributes": attributes}
_code_lines = st.sampled_from(["", "x = 1", "\n  run()\n", " ", "a < b & c", "x = 1\ny = [2]", "]]>"]).map(
    Text
)
_tree_states = st.builds(
    State, id=_few_ids, name=_names, initial=st.booleans(), x=numbers, y=numbers, final=st.sampled_from([False, False, True]),
    children=st.lists(st.integers(1, 5), max_size=3).map(tuple), entry=_code_lines, code=_code_lines, exit=_code_lines,
    history=st.sampled_from(["", "restart", "resume", "later"]).map(Text), arguments=st.lists(arguments, max_size=1).map(tuple),
    results=st.lists(results, max_size=1).map(tuple), **_awkward,
)  # fmt: skip
_triggers = st.sampled_from(
    ["", "500", "8000", " 1.50 ", "0", "later", "x > 1", "return x", "go home", "a", "a.b", "done.state.a", "*", "timeout.a"]
).map(Text)  # fmt: skip
_tree_transitions = st.builds(
    Transition, id=_few_ids, name=_names, x=numbers, y=numbers, origin=_few_ids, destination=_few_ids,
    type=st.sampled_from(["time", "condition", "event", "finished", "later"]), trigger=_triggers,
    guard=st.sampled_from(["", "x", " ", "x\n", "return"]).map(Text), priority=st.sampled_from(["", "1", "2", "x"]).map(Text),
    code=_code_lines, **_awkward,
)  # fmt: skip
_tree_automata = st.builds(
    Automaton, id=st.integers(1, 5), father=_few_ids, states=st.lists(_tree_states, max_size=3).map(tuple),
    transitions=st.lists(_tree_transitions, max_size=4).map(tuple), annotations=written, inputs=parameters, outputs=parameters, imported=imports,
    iteration_time=st.sampled_from(["100", "", "50"]).map(Text), variables=_code_lines, functions=_code_lines,
    **_awkward,
)  # fmt: skip
_plain_parameters = st.lists(
    st.builds(Parameter, name=st.sampled_from(["a", "x", "speed"]), type=code, default=code, description=code), max_size=2
).map(tuple)  # fmt: skip


trees = st.builds(
    Document, root_tag=st.sampled_from(["VisualHFSM", "VisualStates"]), automata=st.lists(_tree_automata, max_size=4).map(tuple),
    parameters=_plain_parameters, language=st.sampled_from(["", "Python", "C++", "ECMAScript"]).map(Text),
    libraries=st.lists(libraries, max_size=1).map(tuple), **_awkward,
)  # fmt: skip
