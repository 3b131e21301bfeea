"""Every kind of target of an assignment: no proof rests on what its name was before.

Each form is run as well, so that it certainly assigns what it is to assign.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from codegen.hfsm import write_document
from codegen.hfsm.document import Document, Library, Text
from codegen.hfsm.model_checker import Reachability, Verdict, check_model
from tests.support.coded_documents import run
from tests.support.examples import examples
from tests.support.gadgets import gadget
from tests.support.model_documents import PATH, automaton, document, on, state, stated, when

LIBRARIES = tuple(
    Library(name=Text(name))
    for name in ("contextlib", "copy", "from tests.support.gadgets import gadget", "itertools")
)
FUNCTIONS = "def give(self, value):\n    return value"


class Binding(NamedTuple):
    """A target, which binds a name to a value, and an expression that gives what fits the target."""

    target: str
    value: str
    pattern: str
    """The same target in `match`; empty where there is none."""


def _within(inner: Binding, before: int, after: int, *, starred: bool, brackets: str) -> Binding:
    """Return a binding within a sequence, between others, of which the last may take several values."""
    others = [f"other{number}" for number in range(before + after)]
    targets = [*others[:before], inner.target, *others[before:]]
    values = [*map(str, range(before)), inner.value, *map(str, range(after))]
    patterns = ["_"] * before + [inner.pattern] + ["_"] * after
    if starred:
        targets.append("*rest")
        patterns.append("*_")
        values += ["7", "8"]
    return Binding(
        f"{brackets[0]}{', '.join(targets)},{brackets[1]}",
        f"[{', '.join(values)}]",
        f"[{', '.join(patterns)}]" if inner.pattern else "",
    )


def bindings(name: str, value: str) -> st.SearchStrategy[Binding]:
    """Draw a binding of a name, which may be an attribute, to a value."""
    leaf = st.just(Binding(name, value, "" if "." in name else name))
    return st.recursive(
        leaf,
        lambda inner: st.builds(
            _within,
            inner,
            st.integers(0, 2),
            st.integers(0, 2),
            starred=st.booleans(),
            brackets=st.sampled_from(["()", "[]"]),
        ),
        max_leaves=3,
    )


VALUES = [
    "{}",
    "self.give({})",
    "copy.copy({})",
    "[{}][0]",
    '{{"key": {}}}["key"]',
    "next(itertools.chain([{}]))",
]
PLACES = [
    "{target} = {value}",
    "first = {target} = {value}",
    "for {target} in [{value}]: pass",
    "for {target} in iter([{value}]): pass",
    "for count, {target} in enumerate([{value}]): pass",
    'for key, {target} in {{"key": {value}}}.items(): pass',
    "for one, {target} in zip('a', [{value}]): pass",
    "with contextlib.nullcontext({value}) as {target}: pass",
    "with contextlib.nullcontext(1), contextlib.nullcontext({value}) as {target}: pass",
    "match {value}:\n    case {pattern}: pass",
    "match [{value}, 1]:\n    case [{pattern}, *_]: pass",
    'match {{"key": {value}}}:\n    case {{"key": {pattern}}}: pass',
    "try:\n    raise ValueError({value})\nexcept ValueError as error:\n    ({target}), = error.args",
]


@st.composite
def assignments(draw: st.DrawFn, name: str, value: str) -> str:
    """Draw code that gives a value to a name."""
    binding = draw(bindings(name, value))
    places = [place for place in PLACES if binding.pattern or "{pattern}" not in place]
    given_value = draw(st.sampled_from(VALUES)).format(binding.value)
    return draw(st.sampled_from(places)).format(
        target=binding.target, value=given_value, pattern=binding.pattern
    )


def written(doc: Document, folder: str) -> Path:
    path = Path(folder) / "assigned.xml"
    path.write_text(write_document(doc), encoding="utf-8")
    return path


_settings = settings(max_examples=examples(15), deadline=None, suppress_health_check=[HealthCheck.too_slow])
NAMES = st.sampled_from(["n", "self.n"])


@_settings
@given(st.data(), NAMES, st.booleans(), st.booleans())
def test_no_proof_denies_an_event_whose_name_was_assigned(
    data: st.DataObject, name: str, known: bool, within: bool
) -> None:
    code = data.draw(assignments(name, '"x"')) + f"\nself.send({name})"
    functions = FUNCTIONS
    if within:
        indented = code.replace("\n", "\n    ")
        functions = f"{FUNCTIONS}\n\ndef go(self):\n    {name} = 'none'\n    {indented}"
        code = "self.go()"
    root = automaton(
        1,
        [state(1, code=code), state(2)],
        [on("x", 1, 2, id=1)],
        functions=Text(functions),
        variables=Text(f"{name} = 'none'") if known else Text(),
    )
    doc = document(root, properties=[stated("never", "s2")], libraries=LIBRARIES)
    with TemporaryDirectory() as folder:
        assert 2 in run(written(doc, folder), 0).first
    assert check_model(doc, PATH).properties[0].verdict is not Verdict.HOLDS


@_settings
@given(st.data(), NAMES)
def test_no_proof_rests_on_a_guard_whose_object_was_assigned(data: st.DataObject, name: str) -> None:
    assigned = data.draw(assignments(name, "gadget"))
    ways = [when(f"{name} > 0.5", 1, number + 1, id=number) for number in (1, 2)]
    root = automaton(
        1,
        [state(1), state(2), state(3)],
        ways,
        functions=Text(FUNCTIONS),
        variables=Text(f"{name} = 1\n{assigned}"),
    )
    doc = document(root, libraries=LIBRARIES)
    gadget.forget()
    with TemporaryDirectory() as folder:
        assert 2 in run(written(doc, folder), 0).fired_, "the second of two equal guards"
    assert check_model(doc, PATH).transitions[1].reachability is not Reachability.IMPOSSIBLE


def test_what_both_sides_spell_out_is_still_followed() -> None:
    for assigned in ('n, m = "y", 1', '[n, m] = ["y", 1]', 'for n, m in [("y", 1)]: pass'):
        root = automaton(1, [state(1, code=f"{assigned}\nself.send(n)"), state(2)], [on("x", 1, 2, id=1)])
        doc = document(root, properties=[stated("never", "s2")], libraries=LIBRARIES)
        assert check_model(doc, PATH).properties[0].verdict is Verdict.HOLDS
