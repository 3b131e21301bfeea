"""Guards that change, events and commands in forms that are hard to follow: none makes a wrong proof.

Each form is run as well, so that it certainly does what it is here for.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import pytest

from codegen.hfsm import write_document
from codegen.hfsm.document import Document, Event, Interface, Library, Parameter, Text
from codegen.hfsm.model_checker import Reachability, Verdict, check_model
from tests.support.coded_documents import commanded, run
from tests.support.gadgets import gadget
from tests.support.model_documents import PATH, automaton, document, on, state, stated, when

LIBRARIES = tuple(
    Library(name=Text(name))
    for name in (
        *(
            "math",
            "collections",
            "contextlib",
            "copy",
            "ctypes",
            "dataclasses",
            "functools",
            "io",
            "itertools",
        ),
        *("operator", "random", "string", "sys", "threading", "unittest.mock", "types", "typing", "weakref"),
        "from operator import attrgetter as find",
        *("tests.support.gadgets as gadgets", "from tests.support.gadgets import Gadget, Number, gadget"),
    )
)
HEADS = (Interface(name="Head", type="PoseHead"), Interface(name="Neck", type="PoseHead"))


class Changing(NamedTuple):
    """A guard that does not hold the first time and holds the second, with the code around it."""

    guard: str
    variables: str = ""
    functions: str = ""


FIELD = "asked = 0\n\n"
GUARDS = [
    # objects of libraries, under any name and operator
    Changing("gadget.pressed"),
    Changing("gadgets.flag"),
    Changing("gadget.pressed is True"),
    Changing("gadgets.flag is True"),
    Changing("self.is_true(gadget.pressed)", "", "def is_true(self, pressed):\n    return pressed is True"),
    Changing("gadget[0]"),
    Changing("1 in gadget"),
    Changing("math.floor(gadget)"),
    Changing("f'{gadget}' == 'True'"),
    Changing("gadget.strip()"),
    Changing("f'{1:{gadget + 2}}' == '  1'"),
    Changing("True if gadget else False"),
    Changing("abs(mine)", "mine = Gadget()"),
    Changing("mine + 1 == 2", "first, mine = 1, gadget"),
    Changing("mine > 3", "mine = random.uniform(Number(), Number())"),
    Changing("mine > 3", "mine = random.gauss(Number(), Number())"),
    Changing("mine == 'b'", "mine = str(Number())"),
    Changing("mine == 'b'", "mine = f'{Number()}'"),
    Changing("pair[1] > 3", "pair = (1, gadget)"),
    Changing("pair == (1, 1)", "pair = (1, gadget)"),
    Changing("-mine", "mine = (None or gadget)"),
    Changing("mine", "mine = 0\nmine = copy.copy(gadget)"),
    Changing("mine", "with contextlib.nullcontext(gadget) as mine: pass"),
    Changing("mine", "match gadget:\n    case mine: pass"),
    Changing("len(self.mine)", "self.mine = gadget"),
    Changing("self.mine == 2", "for self.mine in [gadget]: pass"),
    Changing("record.on", "record = dataclasses.make_dataclass('Record', ['on'])(gadget)"),
    Changing("self.is_on(gadget)", "", "def is_on(self, device):\n    return device > 0.5"),
    Changing("self.is_on()", "", "def is_on(self, device=gadget):\n    return bool(device)"),
    Changing("self.find()", "", "def find(self):\n    found = gadget\n    return found"),
    Changing("self.DEVICE", "", "DEVICE = gadget"),
    # attributes that a library assigns
    Changing("self.on", "self.on = False\nunittest.mock.patch.object(self, 'on', gadget).start()"),
    Changing(
        "self.is_on()",
        "unittest.mock.patch.object(type(self), 'is_on', lambda self: gadget.pressed).start()",
        "def is_on(self):\n    return False",
    ),
    # what is consumed
    Changing("(*left,) == ()", "left = map(int, '12')"),
    Changing("len([*left]) == 0", "left = (each for each in (1, 2))"),
    Changing("self.is_done(*left)", "left = iter([1])", "def is_done(self, *rest):\n    return rest == ()"),
    Changing("[*lines] == []", "lines = io.StringIO('a')"),
    Changing("len(known) == 1 or known['x']", "known = collections.defaultdict(int)"),
    # attributes that run code
    Changing(
        "self.on", "", FIELD + "@property\ndef on(self):\n    self.asked += 1\n    return self.asked == 2"
    ),
    Changing("self.on", "", "on = property(lambda self: gadget)"),
    Changing("self.on", "type(self).on = property(lambda self: gadget)"),
    Changing("self.on", "kind = self.__class__\nkind.on = property(lambda self: gadget.pressed)"),
    Changing("self.on", "", "def __getattr__(self, name):\n    return gadget.pressed"),
]


def guarded(changing: Changing, *guards: str) -> Document:
    """Return a state that guards leave, with the property that one of them holds in the first cycles."""
    ways = [when(guard, 1, number + 2, id=number + 1) for number, guard in enumerate(guards)]
    targets = [state(number + 2) for number in range(len(guards))]
    variables, functions = Text(changing.variables), Text(changing.functions)
    root = automaton(1, [state(1), *targets], ways, variables=variables, functions=functions)
    leaves = stated("eventually", " or ".join(each.name for each in targets), "100")
    return document(root, properties=[leaves], libraries=LIBRARIES)


@pytest.mark.parametrize("changing", GUARDS)
def test_no_proof_rests_on_a_guard_that_changes(changing: Changing, tmp_path: Path) -> None:
    again = guarded(changing, changing.guard, changing.guard)
    path = tmp_path / "guarded.xml"
    path.write_text(write_document(again), encoding="utf-8")
    gadget.forget()
    assert 2 in run(path, 0).fired_, "the second of two equal guards"
    assert check_model(again, PATH).transitions[1].reachability is not Reachability.IMPOSSIBLE
    either = guarded(changing, changing.guard, f"not ({changing.guard})")
    assert check_model(either, PATH).properties[0].verdict is not Verdict.HOLDS


STEADY = [
    Changing("n > 3", "n = 0"),
    Changing("n % 2 == 0", "n = 0\nn += 1"),
    Changing("name.lower().startswith('b')", "name = 'ball'"),
    Changing("math.hypot(*place) < 2 * math.pi", "place = (1.5, 2.0)"),
    Changing("place[0] > place[1]", "place = (1.5, -2.0)"),
    Changing("since is None", "since = gadget"),
    Changing("since > 3", "since = self.clock.now()"),
    Changing("abs(error) < 0.1", "error = math.atan2(1, 2) - 0.5 * 3"),
    Changing("turn > 0.5", "turn = float(gadget) if gadget else 0"),
    Changing("near", "near = float(gadget) < 0.5"),
    Changing("pan > 0.5", "pan = self.Head.getPose().pan"),
    Changing("self.mine > 3", "self.mine = 4"),
    Changing("self.speed > 0.5"),
    Changing("goal > 0.5"),
    Changing("self.near(n)", "n = 2", "def near(self, distance, most=3):\n    return distance < most"),
    Changing("isinstance(n, int)", "n = 2"),
    Changing("seen", "seen = not gadget"),
    Changing("mode is gadgets.MODE", "mode = None"),
]


@pytest.mark.parametrize("steady", STEADY)
def test_plain_values_still_prove(steady: Changing) -> None:
    doc = guarded(steady, steady.guard, f"not ({steady.guard})", "True")
    root = replace(doc.automata[0], inputs=(Parameter(name="goal", type=Text("float"), default=Text("1")),))
    speed = Parameter(name="speed", type=Text("float"), default=Text("1.0"))
    doc = replace(doc, automata=(root,), parameters=(speed,), interfaces=HEADS)
    report = check_model(doc, PATH)
    assert report.transitions[2].reachability is Reachability.IMPOSSIBLE
    library_may_take_time = "gadget" in steady.variables
    assert (report.properties[0].verdict is Verdict.HOLDS) is not library_may_take_time


@pytest.mark.parametrize(("read", "is_proved"), [("value.pan", True), ("time", True), ("age", False)])
def test_a_sample_grows_older_between_two_guards(read: str, is_proved: bool) -> None:
    guard = f"last.{read} > 0.5"
    doc = guarded(Changing(guard, "last = self.Head.getPose.latest()"), guard, f"not {guard}")
    (result,) = check_model(replace(doc, interfaces=HEADS), PATH).properties
    assert (result.verdict is Verdict.HOLDS) is is_proved


REPLACED = [
    "math.floor = gadget",
    "math.floor, other = gadget, 1",
    "for math.floor in [gadget]: pass",
    "with contextlib.nullcontext(gadget) as math.floor: pass",
    "numbers = math\nnumbers.floor = gadget",
    "del math.floor",
    "math.pi = gadget",
    "def put(self):\n    self.floor = gadget\nput(math)",
]


@pytest.mark.parametrize("variables", REPLACED)
@pytest.mark.parametrize("in_functions", [False, True])
def test_what_a_document_replaces_in_a_module_proves_nothing(variables: str, in_functions: bool) -> None:
    """These do not run: other tests need the module."""
    guard = f"math.{'pi' if 'pi' in variables else 'floor'}"
    guard = f"{guard} > 0" if "pi" in variables else f"{guard}(n) > 0"
    functions = ""
    if in_functions:
        indented = variables.replace("\n", "\n    ")
        variables, functions = "self.replace()", f"def replace(self):\n    {indented}"
    changing = Changing(guard, f"n = 1\n{variables}", functions)
    assert check_model(guarded(changing, guard, guard), PATH).transitions[1].reachability is not (
        Reachability.IMPOSSIBLE
    )


@pytest.mark.parametrize("name", ["bool", "float", "int", "str"])
def test_a_library_may_have_the_name_of_a_type(name: str) -> None:
    imported = Library(name=Text(f"from numpy import {name}_ as {name}"))
    doc = replace(guarded(Changing(""), f"{name} > 3", f"not {name} > 3"), libraries=(imported,))
    assert check_model(doc, PATH).properties[0].verdict is not Verdict.HOLDS


@pytest.mark.parametrize(
    ("variables", "guard"),
    [
        ("def count(): pass\ncount.last = None", "count.last is None"),
        ("n = 1\nlater = ((n := each) for each in (1, 2))\nself.lists(later)", "n > 1"),
    ],
)
def test_what_another_thread_may_change_proves_nothing(variables: str, guard: str) -> None:
    doc = guarded(Changing("", variables, "def lists(self, given):\n    pass"), guard, f"not ({guard})")
    assert check_model(doc, PATH).properties[0].verdict is not Verdict.HOLDS


def test_data_of_an_event_proves() -> None:
    ways = [on("x", 1, number, guard, id=number) for number, guard in ((2, WANTED), (3, f"not ({WANTED})"))]
    ways.append(on("x", 1, 4, id=4))
    doc = document(automaton(1, [state(number) for number in (1, 2, 3, 4)], ways), events=(Event(name="x"),))
    assert check_model(doc, PATH).transitions[2].reachability is Reachability.IMPOSSIBLE


WANTED = "event.data['distance'] < 2"

SENDERS = {
    "all_of": """def all_of(*those):
    those[0].send("x")
""",
    "notify": """def notify(self, whom):
    whom.send("x")
""",
    "late": """@property
def late(self):
    self.send("x")
""",
    "goal": """def set_goal(self, goal):
    self.send(goal)
goal = property(None, set_goal)
""",
    "Noisy": """class Noisy:
    def __eq__(self, other):
        other.send("x")
        return True
""",
    "Anything": """class Kind(type):
    def __instancecheck__(cls, one):
        one.send("x")
        return True

class Anything(metaclass=Kind):
    pass
""",
}
FAILING = "try:\n    self.nothing\nexcept AttributeError as error:\n   "
EVAL, SELF, TEXT = "'ev' + 'al'", "'_' + '_self_' + '_'", "'self.se' + 'nd(\"x\")'"
HINT = "[a.send('x') for n in range(2, 9) if hasattr(a := sys._getframe(n).f_locals.get('self'), 'send')]"
FRAME = "import sys\nsys._getframe(1).f_locals['self'].send('x')"
SENDS = [
    # the component in a class
    'class Box:\n    who = self\nBox.who.send("x")',
    'class Box:\n    notify = self.send\nBox.notify("x")',
    'class Box:\n    class Inner:\n        who = self\nBox.Inner.who.send("x")',
    'class Box:\n    for who in (self,):\n        pass\nBox().who.send("x")',
    'me = self\nclass Box:\n    who = you = me\nBox.you.send("x")',
    'class Box(list):\n    pass\nBox([self]).pop().send("x")',
    # special attributes
    'self.send.__call__("x")',
    'notify = self.send.__call__.__call__\nnotify("x")',
    'make, given = self.send.__reduce__()\nmake(*given)("x")',
    "self.notify.__func__(self, self)",
    '(lambda: self.send("x")).__call__()',
    'getattr(self.send, "__call__")("x")',
    'self.__getstate__()["_hfsm_send"]("x", None)',
    # code that gets the component in passing
    "self.all_of()",
    'hasattr(self, "late")',
    'self.goal = "x"',
    "text = f\"{1:{self.send('x') or 3}}\"",
    "self.Noisy() == self",
    "isinstance(self, self.Anything)",
    'ctypes.cast(id(self), ctypes.py_object).value.send("x")',
    'place = int(repr(self).split("0x")[1][:-1], 16)\nctypes.cast(place, ctypes.py_object).value.send("x")',
    'weakref.ref(self)().send("x")',
    'name = ""\nname += "x"\nself.send(name)',
    # attributes that are found by their names
    f"find = getattr\n{FAILING} find(error, 'o' + 'bj').send('x')",
    f"import operator as o\n{FAILING} o.attrgetter('o' + 'bj')(error).send('x')",
    f"import operator as o\nget = o.attrgetter\n{FAILING} get('o' + 'bj')(error).send('x')",
    f"{FAILING} find('o' + 'bj')(error).send('x')",
    f"from operator import attrgetter as get\n{FAILING} get('o' + 'bj')(error).send('x')",
    f"{FAILING} [*map(getattr, [error], ['o' + 'bj'])][0].send('x')",
    f"{FAILING} getattr(*[error, 'o' + 'bj']).send('x')",
    f"find({EVAL})(find({SELF})(print))({TEXT}) if self else 0",
    f"operator.methodcaller({EVAL}, {TEXT})(find({SELF})(print)) if self else 0",
    f"string.Formatter().get_field('0.' + {SELF} + '.' + {EVAL}, [print], {{}})[0]({TEXT}) if self else 0",
    f"match print:\n    case object(__self__=b):\n        match b:\n            case object(eval=e):\n                if self: e({TEXT})",
    # a text that is run
    f"types.FunctionType(compile({FRAME!r}, '', 'ex' + 'ec'), {{}})() if self else 0",
    f"def f(x: {HINT}): pass\ntyping.get_type_hints(f) if self else 0",
]


@pytest.mark.parametrize("code", SENDS)
def test_no_proof_denies_an_event_that_is_sent(code: str, tmp_path: Path) -> None:
    functions = "\n".join(text for name, text in SENDERS.items() if f".{name}" in code or f'"{name}"' in code)
    ways = [on("x", 1, 2, id=1)]
    root = automaton(1, [state(1, code=code), state(2)], ways, functions=Text(functions))
    doc = document(root, properties=[stated("never", "s2")], libraries=LIBRARIES)
    path = tmp_path / "sending.xml"
    path.write_text(write_document(doc), encoding="utf-8")
    assert 2 in run(path, 0).first
    assert check_model(doc, PATH).properties[0].verdict is not Verdict.HOLDS


TELL = "@staticmethod\ndef tell(who, what, rest=None):\n    who.send(what)"


@pytest.mark.parametrize(
    ("imported", "code", "functions"),
    [
        *(
            (f"operator import call as {name}", f"{name}(self.send, 'x')", "")
            for name in ("getattr", "print")
        ),
        ("operator import call as hasattr", "hasattr(self.send, 'x')", ""),
        ("functools import cache as staticmethod", "self.tell('x', 'x')", TELL),
    ],
)
def test_what_a_library_calls_like_python_does_is_not_pythons(
    imported: str, code: str, functions: str, tmp_path: Path
) -> None:
    root = automaton(1, [state(1, code=code), state(2)], [on("x", 1, 2, id=1)], functions=Text(functions))
    libraries = (Library(name=Text(f"from {imported}")),)
    doc = document(root, properties=[stated("never", "s2")], libraries=libraries)
    path = tmp_path / "sending.xml"
    path.write_text(write_document(doc), encoding="utf-8")
    assert 2 in run(path, 0).first
    assert check_model(doc, PATH).properties[0].verdict is Verdict.UNDECIDED


def verdict_beside(code: str) -> Verdict:
    """Return whether a state that only an event leads to is never reached, beside code."""
    root = automaton(1, [state(1, code=code), state(2)], [on("x", 1, 2, id=1)])
    doc = document(root, properties=[stated("never", "s2")], libraries=LIBRARIES)
    return check_model(doc, PATH).properties[0].verdict


HIDDEN = [
    "threading.current_thread()._args[0].send('x')",
    "given = self.clock._agenda",
    "sys.monitoring.register_callback(1, 2, print)",
    "threading.setprofile_all_threads(print)",
    "sys.addaudithook(print)",
    "import logging.config as config\nconfig.dictConfig({'()': 'ext://' + 'operator.call'})",
    "functools.singledispatch(print)",
    "class Kind:\n    __match_args__ = '_' + '_self_' + '_',",
]


@pytest.mark.parametrize("code", HIDDEN)
def test_what_leads_to_the_runtime_proves_nothing(code: str) -> None:
    """These do not run: some need another Python, and others change what all tests use."""
    assert verdict_beside(code) is Verdict.UNDECIDED


QUIET = [
    "class Sum:\n    def __init__(self):\n        self._sum = 0\nlast = Sum()._sum",
    "place = collections.namedtuple('Place', 'x y')(1, 2)._replace(x=2)",
    "x = sorted([], key=operator.attrgetter('place.x'))",
    "x = [operator.methodcaller('lower')(each) for each in 'AB']",
    "x = getattr(math, 'pi', 0) + getattr(math, f'{1:d}_pi', 0)",
    "import re\nx = re.compile('a')",
]


@pytest.mark.parametrize("code", QUIET)
def test_ordinary_attributes_still_prove(code: str) -> None:
    assert verdict_beside(code) is Verdict.HOLDS


HELPERS = """
def halt_all(*those):
    those[0].Head.stop()

def _set_goal(self, goal):
    self.Head.stop()
goal = property(None, _set_goal)

class Holder:
    def __init__(self, head):
        self.head = head

    def __bool__(self):
        self.head.stop()
        return True

    def __format__(self, spec):
        self.head.stop()
        return ""

    def __add__(self, other):
        self.head.stop()
        return self

    def __iter__(self):
        self.head.stop()
        return iter(())

    def __enter__(self):
        self.head.stop()

    def __exit__(self, *_):
        pass

    @property
    def angle(self):
        self.head.stop()

    @angle.setter
    def angle(self, angle):
        self.head.stop()
"""
HOLDER = "holder = self.Holder(self.Head)"
COMMANDS = [
    # proxies that a proxy makes
    ("", "self.Head.ice_invocationTimeout(100).stop()"),
    ("", "self.Head.ice_invocationTimeout(100).ice_invocationTimeout(200).stop()"),
    ("head = self.Head.ice_invocationTimeout(100)", "head.stop()"),
    ("self.quick = self.Head.ice_invocationTimeout(100)", "self.quick.stop()"),
    ("", 'getattr(self.Head, "ice_invocationTimeout")(100).stop()'),
    ("", "make = self.Head.ice_invocationTimeout\nmake(100).stop()"),
    # special attributes, and a proxy in a class
    ("", "self.Head.stop.__call__()"),
    ("", "self.Head.__class__.stop(self.Head)"),
    ("", "class Box:\n    head = self.Head\nBox.head.stop()"),
    ("", "class Box:\n    stop = self.Head.stop\nBox.stop()"),
    # code that gets the proxy in passing
    ("", "self.halt_all()"),
    ("", "self.goal = 3"),
    (HOLDER, "not holder"),
    (HOLDER, 'text = f"{holder}"'),
    (HOLDER, "holder += 1"),
    (HOLDER, "first = [*holder]"),
    (HOLDER, "with holder: pass"),
    (HOLDER, "now = holder.angle"),
    (HOLDER, "holder.angle = 3"),
]


@pytest.mark.parametrize(("variables", "code"), COMMANDS)
def test_no_command_beside_another_is_overlooked(variables: str, code: str, tmp_path: Path) -> None:
    def beside(other: str) -> Document:
        return document(
            automaton(1, [state(1, children=[2, 3])], functions=Text(HELPERS)),
            automaton(2, [state(1, code=code)], father=1, variables=Text(variables)),
            automaton(3, [state(1, code=other)], father=1),
            interfaces=HEADS,
            libraries=LIBRARIES,
        )

    assert commanded(beside(""), tmp_path) == {"Head"}
    report = check_model(beside("self.Head.stop()"), PATH)
    assert report.conflicts or not report.complete
