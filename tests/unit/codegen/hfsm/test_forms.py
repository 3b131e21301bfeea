"""What each form of Python does, and what is claimed of it: no proof is wrong, and ordinary code still proves.

The forms are in tests/support/forms.py. Those that can be run are run in virtual time, so that they certainly do what
they are there for: what is called impossible or proved never happens.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from textwrap import indent

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from codegen.diagnostics import Diagnostics
from codegen.hfsm import write_document
from codegen.hfsm._effects import CodeEffects
from codegen.hfsm.analysis import analyze
from codegen.hfsm.document import Document, Event, Library, Parameter, Text
from codegen.hfsm.loading import check_document
from codegen.hfsm.model_checker import ModelReport, Reachability, Verdict, WhyNever, check_model, report_model
from tests.support import forms
from tests.support.coded_documents import Visits, commanded, run, sent_by
from tests.support.examples import examples
from tests.support.forms import Form, Spoken
from tests.support.gadgets import gadget
from tests.support.model_documents import PATH, after, automaton, document, on, state, stated, when
from tests.support.soak import cases


def stating(form: Form, *guards: str, event: bool = False, within: tuple[str, ...] = ()) -> Document:
    """Return a document with a state, which guards and an event leave to others, and properties of these.

    They are that each is never reached, and that one of them is reached within each of some times.
    """
    ways = [when(guard, 1, number + 1, id=number) for number, guard in enumerate(guards, 1)]
    if event:
        ways.append(on("x", 1, len(ways) + 2, id=len(ways) + 1))
    others = [state(number) for number in range(2, len(ways) + 2)]
    names = [each.name for each in others]
    texts = form.variables, form.code, *guards
    functions = forms.with_functions(form.functions, *texts)
    root = automaton(
        1, [state(1, code=form.code), *others], ways,
        functions=Text(functions), variables=Text(form.variables),
    )  # fmt: skip
    own = (Library(name=Text(form.library)),)
    libraries = own if form.library else forms.libraries_of(functions, *texts)
    properties = [stated("never", name) for name in names]
    properties += [stated("eventually", " or ".join(names), each) for each in within]
    heads = forms.HEADS if any("Head" in text for text in texts) else ()
    return document(root, properties=properties, libraries=libraries, interfaces=heads)


def sending(form: Form) -> Document:
    """Return a document whose state runs a form, and is left by the event `x`."""
    return stating(form._replace(text="", code=form.text), event=True)


def saved(doc: Document, folder: Path) -> Path:
    path = folder / "forms.xml"
    path.write_text(write_document(doc), encoding="utf-8")
    return path


def checked(doc: Document, folder: Path) -> tuple[ModelReport, Diagnostics]:
    diagnostics = Diagnostics()
    report = check_document(saved(doc, folder), diagnostics)
    assert report is not None, diagnostics.render()
    return report, diagnostics


def never_left(report: ModelReport) -> Verdict:
    """Return the verdict on the property that the first state beside the initial one is never reached."""
    return report.properties[0].verdict


def check_sends(form: Form, folder: Path) -> Verdict:
    """Run a form, which is to send `x`; return the verdict on the property that this never comes."""
    doc = sending(form)
    assert 2 in run(saved(doc, folder), 0).first
    report, diagnostics = checked(doc, folder)
    assert never_left(report) is not Verdict.HOLDS
    assert "W526" not in {found.code for found in diagnostics}, "the event is called impossible"
    return never_left(report)


def check_may_change(form: Form) -> None:
    again = check_model(stating(form, form.text, form.text), PATH)
    assert again.transitions[1].reachability is not Reachability.IMPOSSIBLE
    either = check_model(stating(form, form.text, f"not ({form.text})", within=("500",)), PATH)
    assert either.properties[-1].verdict is not Verdict.HOLDS


def check_changes(form: Form, folder: Path) -> None:
    """Run a guard, which is to hold when it is asked the second time."""
    gadget.forget()
    again = saved(stating(form, form.text, form.text), folder)
    assert 2 in run(again, 0).fired_, "the second of two equal guards"
    check_may_change(form)


@pytest.mark.parametrize("code", forms.SENDS)
def test_no_proof_denies_an_event_that_is_sent(code: str, tmp_path: Path) -> None:
    check_sends(Form(code), tmp_path)


@pytest.mark.parametrize("form", forms.SENDS_BY_A_LIBRARY)
def test_what_a_library_calls_like_python_does_is_not_pythons(form: Form, tmp_path: Path) -> None:
    assert check_sends(form, tmp_path) is Verdict.UNDECIDED


@pytest.mark.parametrize("form", forms.MAY_SEND)
def test_what_code_that_cannot_be_followed_may_send_is_undecided_and_said(form: Form, tmp_path: Path) -> None:
    report, diagnostics = checked(sending(form), tmp_path)
    assert never_left(report) is Verdict.UNDECIDED
    assert not report.complete
    assert "may send any event" in "".join(f.message for f in diagnostics if f.code == "N606")


@pytest.mark.parametrize("form", forms.SENDS_NOTHING)
def test_an_event_that_nothing_sends_is_impossible(form: Form, tmp_path: Path) -> None:
    report, diagnostics = checked(sending(form), tmp_path)
    assert never_left(report) is Verdict.HOLDS
    assert "W526" in {found.code for found in diagnostics}


@pytest.mark.parametrize(
    "functions",
    [
        "def say(self, word):\n    self.say(word + 'o') if len(word) < 2 else self.send(word)",
        "def say(self, word):\n    self.say(word + 'o')\n    self.say('p' + word)",
        "def say(self, word):\n    self.say(lambda: word)",
    ],
)
def test_functions_that_call_themselves_with_new_values_come_to_an_end(functions: str) -> None:
    doc = document(automaton(1, [state(1, code="self.say('x')")], functions=Text(functions)))
    assert CodeEffects(analyze(doc, PATH)).of(doc.automata[0].states[0].code).any_event


@pytest.mark.parametrize("spoken", forms.SPOKEN)
def test_a_text_is_known_only_if_all_its_values_are(spoken: Spoken, tmp_path: Path) -> None:
    code = f"{spoken.before}\nself.send({spoken.text})\n{spoken.after}"
    root = automaton(
        1, [state(1, code=code)], functions=Text(forms.with_functions("", code)), variables=Text(spoken.variables)
    )  # fmt: skip
    doc = document(root, libraries=forms.libraries_of(code, spoken.variables))
    sent = sent_by(saved(doc, tmp_path))
    assert sent
    ways = tuple(on(event, 1, 1, id=number) for number, event in enumerate(sorted(sent), 1))
    doc = replace(doc, automata=(replace(root, transitions=ways),))
    known = CodeEffects(analyze(doc, PATH)).of(doc.automata[0].states[0].code)
    assert bool(known.any_event) == (spoken.events is None)
    if spoken.events is not None:
        assert sent <= known.events.keys() == spoken.events


def test_data_of_an_event_may_be_any_text(tmp_path: Path) -> None:
    ways = [on("ask", 1, 1, id=1, code="self.send(event.data)"), on("x", 1, 2, id=2)]
    root = automaton(1, [state(1, code="self.send('ask', 'x')"), state(2)], ways)
    doc = document(root, properties=[stated("never", "s2")])
    assert 2 in run(saved(doc, tmp_path), 0).first
    assert never_left(check_model(doc, PATH)) is not Verdict.HOLDS


@pytest.mark.parametrize("form", forms.CHANGES)
def test_no_proof_rests_on_a_guard_that_changes(form: Form, tmp_path: Path) -> None:
    check_changes(form, tmp_path)


@pytest.mark.parametrize("form", forms.MAY_CHANGE)
def test_no_proof_rests_on_a_guard_that_may_change(form: Form) -> None:
    check_may_change(form)


@pytest.mark.parametrize("form", forms.STAYS)
def test_plain_values_still_prove(form: Form) -> None:
    doc = stating(form, form.text, f"not ({form.text})", "True", within=("100",))
    root = replace(doc.automata[0], inputs=(Parameter(name="goal", type=Text("float"), default=Text("1")),))
    speed = Parameter(name="speed", type=Text("float"), default=Text("1.0"))
    report = check_model(replace(doc, automata=(root,), parameters=(speed,)), PATH)
    assert report.transitions[2].reachability is Reachability.IMPOSSIBLE
    library_may_take_time = "gadget" in f"{form.variables}{form.text}"
    assert (report.properties[-1].verdict is Verdict.HOLDS) is not library_may_take_time


@pytest.mark.parametrize("guard", ["self.coin()", "self.often()", "random.random() < 0.5", "self.take()"])
def test_guards_that_draw_lots_make_no_proof_and_may_fail(guard: str) -> None:
    report = check_model(stating(Form(guard), guard, f"not {guard}", within=("200",)), PATH)
    assert report.properties[-1].verdict is Verdict.VIOLATED


@pytest.mark.parametrize(
    "form",
    [Form("self.tick()"), Form("self.every_third()"), Form("toggle.value", "toggle = self.Toggle()")],
)
def test_guards_with_state_are_undecided_and_said(form: Form) -> None:
    report = check_model(stating(form, form.text, f"not ({form.text})", within=("500",)), PATH)
    assert report.properties[-1].verdict is Verdict.UNDECIDED
    report_model(report, diagnostics := Diagnostics())
    assert "N606" in {found.code for found in diagnostics}


def test_a_comparison_of_constants_has_one_truth() -> None:
    report = check_model(stating(Form(""), '"a" == b"a"'), PATH)
    assert never_left(report) is Verdict.HOLDS
    assert report.transitions[0].why is WhyNever.GUARD


@pytest.mark.parametrize(("read", "is_proved"), [("value.pan", True), ("time", True), ("age", False)])
def test_a_sample_grows_older_between_two_guards(read: str, is_proved: bool) -> None:
    guard = f"last.{read} > 0.5"
    form = Form(guard, "last = self.Head.getPose.latest()")
    report = check_model(stating(form, guard, f"not {guard}", within=("100",)), PATH)
    assert (report.properties[-1].verdict is Verdict.HOLDS) is is_proved


def test_data_of_an_event_proves() -> None:
    wanted = "event.data['distance'] < 2"
    ways = [on("x", 1, number, guard, id=number) for number, guard in ((2, wanted), (3, f"not ({wanted})"))]
    ways.append(on("x", 1, 4, id=4))
    doc = document(automaton(1, [state(number) for number in (1, 2, 3, 4)], ways), events=(Event(name="x"),))
    assert check_model(doc, PATH).transitions[2].reachability is Reachability.IMPOSSIBLE


def drawn(most: int) -> settings:
    """Return settings for tests that draw forms."""
    slow = [HealthCheck.too_slow, HealthCheck.function_scoped_fixture]
    return settings(max_examples=examples(most), deadline=None, suppress_health_check=slow)


@pytest.mark.slow
@drawn(6)
@given(
    guards=st.lists(st.sampled_from(forms.DRAWN_GUARDS), min_size=1, max_size=4),
    code=st.sampled_from(["", "n += 1", *forms.SENDS_BY_ANY_NAME]),
    event=st.booleans(),
)
def test_no_verdict_is_wrong_for_code_with_aliases_and_state(
    guards: list[str], code: str, event: bool, tmp_path: Path
) -> None:
    words = "\n".join([*guards, code])
    variables = "\n".join(text for name, text in forms.VARIABLES.items() if name in words)
    doc = stating(Form("", variables, code=code), *guards, event=event, within=("100", "200", "500"))
    report, diagnostics = checked(doc, tmp_path)
    for seed in range(3):
        assert_agrees(report, diagnostics, run(saved(doc, tmp_path), seed))


def assert_agrees(report: ModelReport, diagnostics: Diagnostics, seen: Visits) -> None:
    for transition in report.transitions:
        assert not (
            transition.reachability is Reachability.IMPOSSIBLE and transition.transition in seen.fired_
        ), transition
    for result in report.properties:
        if result.verdict is not Verdict.HOLDS:
            continue
        wanted = {int(name[1:]) for name in result.property.expression.text.split(" or ")}
        times = [at for number, at in seen.first.items() if number in wanted]
        if result.property.kind == "never":
            assert not times, result.property
        else:
            assert times, result.property
            assert min(times) <= float(result.property.within.text) * 1e6, result.property
    for found in diagnostics:
        if found.code == "W516":
            number = int(found.message.split()[1])
            assert number not in seen.fired_, found.message


def siblings(
    first: Form, second: str, *, guard: bool = False, father: str = "", variables: str = ""
) -> Document:
    """Return two parallel automata; the code of the first may be in a guard instead."""
    ways = [when(f"{first.text}\nreturn False", 1, 2)] if guard else []
    states = [state(1, code="" if guard else first.text), *([state(2)] if guard else [])]
    functions = first.functions or forms.with_functions("", first.text, first.variables)
    return document(
        automaton(1, [state(1, children=[2, 3])], functions=Text(functions), variables=Text(father)),
        automaton(2, states, ways, father=1, variables=Text(f"{variables}\n{first.variables}")),
        automaton(3, [state(1, code=second)], father=1, variables=Text(variables)),
        interfaces=forms.HEADS,
        libraries=forms.libraries_of(functions, first.text, second),
    )


@pytest.mark.parametrize("form", forms.COMMANDS)
def test_no_command_beside_another_is_overlooked(form: Form, tmp_path: Path) -> None:
    assert commanded(siblings(form, ""), tmp_path) == {"Head"}
    report = check_model(siblings(form, "self.Head.stop()"), PATH)
    assert report.conflicts or not report.complete


@drawn(6)
@given(
    first=st.sampled_from(forms.COMMANDS_OF_TWO), second=st.sampled_from(forms.COMMANDS_OF_TWO), guard=st.booleans()
)  # fmt: skip
def test_no_conflict_of_code_with_aliases_and_helpers_is_denied_or_made_up(
    first: str, second: str, guard: bool, tmp_path: Path
) -> None:
    def beside(code: str, other: str, *, guard: bool) -> Document:
        form = Form(code, functions=forms.HELPERS)
        return siblings(form, other, guard=guard, father=forms.START, variables="shared = self.Neck")

    report = check_model(beside(first, second, guard=guard), PATH)
    of_first = commanded(beside(first, "", guard=guard), tmp_path)
    of_second = commanded(beside("", second, guard=False), tmp_path)
    found = {conflict.first.command.identity: conflict.certain for conflict in report.conflicts}
    if report.complete:
        assert of_first & of_second <= found.keys()
    else:
        assert report.doubtful or not all(found.values())
    assert {identity for identity, certain in found.items() if certain} <= of_first & of_second


@pytest.mark.parametrize(("first", "then"), forms.LEFT_BEHIND)
def test_what_a_state_leaves_to_another_is_followed_or_undecided(
    first: str, then: str, tmp_path: Path
) -> None:
    below = [
        automaton(2, [state(1, code=first), state(2, code=then)], [after(200, 1, 2)], father=1),
        automaton(3, [state(1), state(2, code="self.Head.stop()")], [after(200, 1, 2)], father=1),
    ]
    root = automaton(1, [state(1, children=[2, 3])], functions=Text(forms.HELPERS))
    doc = document(root, *below, interfaces=forms.HEADS[:1])
    still = replace(below[1], states=(state(1), state(2)))
    assert commanded(replace(doc, automata=(root, below[0], still)), tmp_path) == {"Head"}
    report = check_model(doc, PATH)
    assert report.conflicts or not report.complete


@pytest.mark.parametrize(("name", "code"), cases(*forms.assignments('"x"')))
@pytest.mark.parametrize("where", ["code of the state", "a function"])
def test_no_proof_denies_an_event_whose_name_was_assigned(
    name: str, code: str, where: str, tmp_path: Path
) -> None:
    before, sent = f"{name} = 'none'", f"{code}\nself.send({name})"
    function = "def go(self):\n" + indent(f"{before}\n{sent}", "    ")
    inside = where == "a function"
    check_sends(Form("self.go()", functions=function) if inside else Form(sent, before), tmp_path)


@pytest.mark.parametrize(("name", "code"), cases(*forms.assignments("gadget")))
def test_no_proof_rests_on_a_guard_whose_object_was_assigned(name: str, code: str, tmp_path: Path) -> None:
    check_changes(Form(f"{name} > 0.5", f"{name} = 1\n{code}"), tmp_path)


@pytest.mark.parametrize("assigned", ['n, m = "y", 1', '[n, m] = ["y", 1]', 'for n, m in [("y", 1)]: pass'])
def test_what_both_sides_spell_out_is_still_followed(assigned: str) -> None:
    assert never_left(check_model(sending(Form(f"{assigned}\nself.send(n)")), PATH)) is Verdict.HOLDS
