"""The closed list of forms that are followed, and forms beyond it: each is run and compared with what is claimed.

A form beyond the list sends `x`, or changes a guard, in a way that must leave the question open. A form of the
list does the same, and the events that it sends are known.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from codegen.hfsm import write_document
from codegen.hfsm._effects import CodeEffects
from codegen.hfsm._piece_effects import Effects
from codegen.hfsm.analysis import analyze
from codegen.hfsm.document import Document, Event, Interface, Library, Text
from codegen.hfsm.model_checker import Reachability, Verdict, check_model
from tests.support.coded_documents import Visits, run, sent_by
from tests.support.model_documents import PATH, automaton, document, on, state, stated, when

LIBRARIES = tuple(
    Library(name=Text(name))
    for name in (
        *(
            "bisect",
            "collections",
            "contextlib",
            "copy",
            "functools",
            "heapq",
            "itertools",
            "math",
            "operator",
        ),
        *("queue", "random", "re", "threading", "types", "unittest.mock", "weakref", "inspect", "sys"),
    )
)
CONSTANTS = 'WORDS = ("decoy", "x")\n'
FUNCTIONS = f"""{CONSTANTS}
def say(self, word="decoy", *more, late="decoy", **others):
    self.send(word)
    self.send(late)

def second(self, number=0, word="decoy"):
    self.send(word)

def pass_on(self, *words, **named):
    self.say(*words, **named)

def rest(self, *words):
    self.send(words[0])

def named(self, **words):
    self.send(words["word"])

def only(self, word, /, **words):
    self.send(words["word"])

def again(self, word="decoy", depth=2):
    if depth:
        self.again(*[word, depth - 1])
    else:
        self.send(word)

def wait(self, word="decoy"):
    yield
    self.send(word)

def give(self, word="decoy"):
    return lambda: self.send(word)
"""


def functions_for(code: str) -> str:
    """Return the functions that code names, and those that they name: any other may let something escape."""
    wanted = code
    for _ in _NAMED:  # as deep as they may name each other
        wanted = code + "".join(text for name, text in _NAMED.items() if re.search(rf"\b{name}\b", wanted))
    return CONSTANTS + wanted.removeprefix(code)


_NAMED = {each.split("(")[0]: f"\ndef {each}" for each in FUNCTIONS.split("\ndef ")[1:]}


def sending(code: str, variables: str = "") -> Document:
    """Return a document whose code is to send `x`, for which it waits, and its property that this never comes."""
    root = automaton(
        1,
        [state(1, code=code), state(2)],
        [on("x", 1, 2, id=1)],
        functions=Text(functions_for(code + variables)),
        variables=Text(variables),
    )
    return document(root, properties=[stated("never", "s2")], libraries=LIBRARIES)


def seen_in(doc: Document, folder: Path) -> Visits:
    path = folder / "forms.xml"
    path.write_text(write_document(doc), encoding="utf-8")
    return run(path, 0)


CALLS = [
    # arguments that are not single
    'self.say(*["x"])',
    'self.say(*("x",))',
    'self.say(**{"word": "x"})',
    'self.say(**dict(late="x"))',
    'self.second(1, *["x"])',
    'self.second(*[1], word="x")',
    'self.pass_on("x")',
    'self.pass_on(word="x")',
    'self.rest("x")',
    'self.named(word="x")',
    'self.only(0, word="x")',
    'self.again("x")',
    # functions that are kept, or called by others
    '{"go": self.say}["go"]("x")',
    '[self.say][0]("x")',
    '(self.say, 1)[0]("x")',
    'keep = []\nkeep.append(self.say)\nkeep.pop()("x")',
    'functools.partial(self.say, "x")()',
    'functools.partialmethod(self.say, "x").func("x")',
    '[*map(self.say, ["x"])]',
    '[*filter(self.say, ["x"])]',
    '[*itertools.starmap(self.say, [("x",)])]',
    'sorted(["x"], key=self.say)',
    'max(["x"], key=self.say)',
    'min("x", "x", key=lambda word: self.say(*word) or 1)',
    'heapq.nsmallest(1, ["x"], key=self.say)',
    'bisect.bisect([1], 1, key=lambda number: self.say(*"x") or number)',
    'functools.reduce(lambda so_far, word: self.send(word), ["x"], 0)',
    'functools.reduce(self.second, ["x"], 0)',
    'call = threading.Thread(target=self.say, args=["x"])\ncall.start()\ncall.join()',
    'call = threading.Timer(0, self.say, kwargs={"word": "x"})\ncall.start()\ncall.join()',
    'with contextlib.ExitStack() as stack:\n    stack.callback(self.say, "x")',
    'with contextlib.closing(types.SimpleNamespace(close=lambda: self.say(*["x"]))):\n    pass',
    'kept = threading.Thread()\nweakref.finalize(kept, self.say, "x")\ndel kept',
    'q = queue.SimpleQueue()\nq.put(self.say)\nq.get()("x")',
    'operator.methodcaller("say", "x")(self)',
    'operator.attrgetter("say")(self)("x")',
    're.sub("x", lambda found: self.say(found[0]) or "", "x")',
    'unittest.mock.Mock(side_effect=self.say)("x")',
    'iter(lambda: self.say(*"x"), 1).__next__()',
    'copy.copy(self.say)("x")',
    'inspect.signature(self.say).bind("x") and self.say.__call__("x")',
    'types.MethodType(lambda me, word: me.send(word), self)("x")',
    # the class, and another `self`
    'type(self).say(self, "x")',
    'type(self).second(self, 1, "x")',
    'self.__class__.say(self, "x")',
    'Forms.say(self, "x")',
    'super(Forms, self).send("x")',
    'Forms.late = lambda me: me.send("x")\nself.late()',
    'setattr(Forms, "late", property(lambda me: me.send("x")))\nself.late',
    # names that mean something else
    'print = self.say\nprint("x")',
    'self.say = lambda word: self.send("x")\nself.say("decoy")',
    'self.WORDS = self.say\nself.WORDS("x")',
    'math.leap = self.say\nmath.leap("x")\ndel math.leap',
    'global leap\nleap = self.say\nleap("x")',
    'getattr = lambda *them: self.say\ngetattr(self, "second")("x")',
    # code that runs later, or elsewhere
    '[*self.wait("x")]',
    'def later(word="decoy"):\n    yield self.send(word)\n[*later("x")]',
    '[*(lambda word="decoy": (yield self.send(word)))("x")]',
    '[*(self.send(word) for word in ["x"])]',
    'self.give("x")()',
    '(lambda word="decoy": self.send(word))("x")',
    '(lambda word="decoy", *, say=self.send: say(word))("x")',
    'def say(word="decoy"):\n    def inner():\n        self.send(word)\n    return inner\nsay("x")()',
    'def say(who=None):\n    for turn in (1, 2):\n        if who is not None:\n            who.send("x")\n        who = self\nsay()',
    '@lambda say: say("x")\ndef ready(word="decoy"):\n    self.send(word)',
    'async def later(word="decoy"):\n    self.send(word)\ntry:\n    later("x").send(None)\nexcept StopIteration:\n    pass',
    'class Door:\n    def __enter__(me):\n        self.send("x")\n    def __exit__(me, *_):\n        pass\nwith Door():\n    pass',
    'class Key:\n    def __lt__(me, other):\n        self.send("x")\n        return True\nsorted([Key(), Key()])',
    'class Words(dict):\n    def __missing__(me, word):\n        self.send(word)\nWords()["x"]',
    'class Way:\n    def __init_subclass__(cls, word="decoy"):\n        self.send(word)\nclass Other(Way, word="x"):\n    pass',
    'try:\n    raise ValueError(self.say)\nexcept ValueError as error:\n    error.args[0]("x")',
    'match [self.say]:\n    case [say]:\n        say("x")',
    'match {"say": self.say}:\n    case {"say": say}:\n        say("x")',
    'say, *_ = [self.say]\nsay("x")',
    'for say in iter([self.say]):\n    say("x")',
    '[say("x") for say in [*[self.say]]]',
    '[found := self.say][0]("x")',
    # what nobody names
    'globals()["Forms"].say(self, "x")',
    'vars(Forms)["say"](self, "x")',
    'self.say.__func__(self, "x")',
    'self.say.__func__.__defaults__ = ("x",)\nself.say()',
    '(lambda: 0).__globals__["Forms"].say(self, "x")',
    'self and sys._getframe().f_locals["self"].send("x")',
    'self and operator.attrgetter("f_locals")(sys._getframe())["self"].send("x")',
    'sys.modules[type(self).__module__].Forms.say(self, "x")',
    'old = self._hfsm_send\nself._hfsm_send = lambda name, data: old("x", data)\nself.send("decoy")\nself._hfsm_send = old',
    'self.__private = self.say\nself._Forms__private("x")',
    'eval("self.say(\'x\')", {"self": self})',
    'self and exec("self.say(\'x\')")',
]  # fmt: skip


CALLS += [
    f"try:\n    self.nothing\nexcept AttributeError as error:\n    {use}"
    for use in (
        "error.obj.send('x')",
        "getattr(error, 'obj').send('x')",
        "getattr(error, 'o' + error.name[:0] + 'bj').send('x')",
        "operator.attrgetter('obj.send')(error)('x')",
        "operator.attrgetter(error.name and 'obj')(error).send('x')",
        "match error:\n        case AttributeError(obj=found):\n            found.send('x')",
        "sys.exc_info()[1].obj.send('x')",
    )
]


def test_code_that_sends_nothing_leaves_the_proof() -> None:
    doc = sending("self.say(word='decoy', late='other')")
    assert check_model(doc, PATH).properties[0].verdict is Verdict.HOLDS


@pytest.mark.parametrize("code", CALLS)
def test_no_proof_denies_what_a_call_beyond_the_list_sends(code: str, tmp_path: Path) -> None:
    doc = sending(code)
    assert 2 in seen_in(doc, tmp_path).first
    assert check_model(doc, tmp_path / "forms.xml").properties[0].verdict is not Verdict.HOLDS


@pytest.mark.parametrize(
    "functions",
    [
        "def say(self, word):\n    self.say(word + 'o') if len(word) < 2 else self.send(word)",
        "def say(self, word):\n    self.say(word + 'o')\n    self.say('p' + word)",
        "def say(self, word):\n    self.say(lambda: word)",
    ],
)
def test_functions_that_call_themselves_with_new_values_come_to_an_end(functions: str) -> None:
    root = automaton(1, [state(1, code="self.say('x')")], functions=Text(functions))
    doc = document(root)
    assert CodeEffects(analyze(doc, PATH)).of(doc.automata[0].states[0].code).any_event


TEXTS = [
    # values that are no texts, among texts
    ("n = 0", "", 'f"{n}"', "n = 'last'"),
    ("n = None", "", 'f"{n}"', "n = 'left'"),
    ("n = b'y'", "", 'f"{n}"', "n = 'left'"),
    ("self.n = 7", "", 'f"{self.n}"', "self.n = 'left'"),
    ("k = True", "", "f\"{k or 'y'}\"", ""),
    ("k = 0", "", "f\"{not k or 'y'}\"", ""),
    ("k = 0", "", "f\"{'y' if k else 1}\"", ""),
    ("n = 'left'", "", 'f"{(n := 3)}"', ""),
    # texts that are made
    ("n = 'left'", "", 'f"{n!r}"', ""),
    ("n = 'left'", "", 'f"{n:>5}"', ""),
    ("n = 'left'", "", 'f"{n=}"', ""),
    ("n = 'left'", "", 'f"{(n,)}"', ""),
    ("n = 'left'", "", '"%s" % n', ""),
    ("n = 2", "", '"y" * n', ""),
    ("n = 'left'", "", "n[::-1]", ""),
    ("n = 'left'", "", "n.upper()", ""),
    ("n = 'left'", "", '"-".join([n, n])', ""),
    ("n = 3", "", 'str(n) + "left"', ""),
    ("n = 1", "", "self.WORDS[n]", ""),
    ("n = 'left'", "", "dict(word=n)['word']", ""),
    # unpacked and bound
    ("", "a, b = {'left', 'y'}", "a", ""),
    ("", "a, b = {'left': 1, 'y': 2}", "b", ""),
    ("", "a, b = 'xy'", "a", ""),
    ("", "a, *b = 'y', 'left'", "b[0]", ""),
    ("", "[a] = [each for each in ['left']]", "a", ""),
    ("a = 'y'", "a += 'left'", "a", ""),
    ("", "for a in 'xy':\n    pass", "a", ""),
    ("", "for a in {**{'left': 1}}:\n    pass", "a", ""),
    ("", "for a in (*['left'],):\n    pass", "a", ""),
    ("", "try:\n    raise KeyError('left')\nexcept KeyError as error:\n    a = error.args[0]", "a", ""),
    ("", "match ['left']:\n    case [a]:\n        pass", "a", ""),
    ("a = 'y'", "def bind():\n    nonlocal a\n    a = random.choice(['left'])\nbind()", "a", ""),
    ("", "class Box:\n    a = 'left'", "Box.a", ""),
    ("", "a = functools.partial(str, 'left')()", "a", ""),
]  # fmt: skip
FOLLOWED = [
    ("", "", '"y"', "", {"y"}),
    ("n = 'left'", "", 'f"{n}-{n}"', "", {"left-left"}),
    ("n = 'left'", "", '"to " + n', "n = 'right'", {"to left", "to right"}),
    ("n = 'left'", "", "n if n else 'y'", "", {"left", "y"}),
    ("n = None", "", "n or 'y'", "n = 'left'", {"left", "y"}),
    ("self.n = 'left'", "", "self.n", "", {"left"}),
    ("", "", "(n := 'left')", "", {"left"}),
    ("", "a, b = 'left', 'y'", "b", "", {"y"}),
    ("", "[a, b] = 'y', 'left'", "a", "", {"y"}),
    ("", "for a in ('left', 'y'):\n    pass", "a", "", {"left", "y"}),
    ("", "def bind():\n    nonlocal a\n    a = 'left'\nbind()", "a", "a = 'y'", {"left", "y"}),
    ("", "me = self\nme.n = 'left'", "self.n", "", {"left"}),
    ("", "a = [each for each in ('left', 'y')]", "'y'", "print(self, self.log)", {"y"}),
    ("", "a = getattr(self, 'WORDS')", "'y'", "hasattr(self, 'WORDS')", {"y"}),
]


@pytest.mark.parametrize(("variables", "before", "text", "after"), TEXTS)
def test_a_text_is_known_only_if_all_its_values_are(
    variables: str, before: str, text: str, after: str, tmp_path: Path
) -> None:
    known, sent = claimed_and_sent(variables, f"{before}\nself.send({text})\n{after}", tmp_path)
    assert sent
    assert known.any_event


@pytest.mark.parametrize(("variables", "before", "text", "after", "events"), FOLLOWED)
def test_texts_of_the_closed_list_are_known(
    variables: str, before: str, text: str, after: str, events: set[str], *, tmp_path: Path
) -> None:
    known, sent = claimed_and_sent(variables, f"{before}\nself.send({text})\n{after}", tmp_path)
    assert sent <= known.events.keys() == events
    assert not known.any_event


def claimed_and_sent(variables: str, code: str, folder: Path) -> tuple[Effects, set[str]]:
    """Return what is known of code, and the events that it sends."""
    root = automaton(1, [state(1, code=code)], functions=Text(CONSTANTS), variables=Text(variables))
    doc = document(root, libraries=LIBRARIES)
    path = folder / "forms.xml"
    path.write_text(write_document(doc), encoding="utf-8")
    return CodeEffects(analyze(doc, path)).of(doc.automata[0].states[0].code), sent_by(path)


def test_data_of_an_event_may_be_any_text(tmp_path: Path) -> None:
    ways = [on("ask", 1, 1, id=1, code="self.send(event.data)"), on("x", 1, 2, id=2)]
    root = automaton(1, [state(1, code="self.send('ask', 'x')"), state(2)], ways)
    doc = document(root, properties=[stated("never", "s2")])
    assert 2 in seen_in(doc, tmp_path).first
    assert check_model(doc, PATH).properties[0].verdict is not Verdict.HOLDS


HEAD = (Interface(name="Head", type="PoseHead"),)
GUARDS = [
    # a guard, what is there first, what runs in each cycle, and functions: it may answer otherwise when asked again
    ("self.on", "self.on = False\ndef turn():\n    self.on = True\nlater = threading.Timer(9, turn)", "", ""),
    ("self.on", "self.on = False\nlater = lambda: self.turn()", "", "def turn(self):\n    self.on = True"),
    ("n > 0", "n = 0\ndef turn():\n    nonlocal n\n    n += 1\nlater = threading.Timer(9, turn)", "", ""),
    ("pose.pan > 0", "pose = None", "pose = self.Head.getPose()\npose.pan = 3", ""),
    ("pose.pan > 0", "pose = None", "pose = self.Head.getPose()\nself.pose = pose", ""),
    ("pose[0] > 0", "pose = None", "pose = self.Head.getPose()\npose.sort()", ""),
    ("pose[0] > 0", "pose = None", "pose = self.Head.getPose()\nother = pose\nother[0] += 1", ""),
    ("pose[0] > 0", "pose = None", "pose = self.Head.getPose()\nsort = pose.sort\nsort()", ""),
    ("pose[0] > 0", "pose = None", "pose = self.Head.getPose()\nlater = [pose]", ""),
    ("n[0]", "n = [1]", "", ""),
    ("n in m", "n = 1\nm = iter([1])", "", ""),
    ("self.n > 0", "self.n = 1\nsetattr(self, 'n', 2)", "", ""),
    ("n", "n = queue.SimpleQueue()", "", ""),
    ("math.floor(n) > 0", "n = 1\nnumbers = math\nnumbers.floor = max", "", ""),
    ("self.is_on()", "", "", "def is_on(self, asked=[]):\n    asked.append(1)\n    return len(asked) > 1"),
    ("self.is_on(*n)", "n = iter([1])", "", "def is_on(self, *n):\n    return n"),
    ("isinstance(n, Kind)", "n = 1\nclass Kind:\n    pass", "", ""),
    ("(lambda: n)()", "n = 1", "", ""),
    ("[each for each in (n,)] == []", "n = 1", "", ""),
    ("bool(self.later)", "self.later = threading.Timer(9, self.turn)", "", "def turn(self):\n    pass"),
]  # fmt: skip


@pytest.mark.parametrize(("guard", "variables", "code", "functions"), GUARDS)
def test_no_guard_beyond_the_list_keeps_its_answer(
    guard: str, variables: str, code: str, functions: str
) -> None:
    """Whether they change within a cycle is a matter of luck: those that certainly do are run elsewhere."""
    root = automaton(
        1,
        [state(1, code=code), state(2), state(3)],
        [when(guard, 1, number, id=number) for number in (2, 3)],
        functions=Text(functions),
        variables=Text(variables),
    )
    doc = document(root, libraries=LIBRARIES, interfaces=HEAD, events=(Event(name="x"),))
    assert check_model(doc, PATH).transitions[1].reachability is not Reachability.IMPOSSIBLE
