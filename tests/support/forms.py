"""Forms of Python, and what each must be found to do: a row for each, which tests of the model checker run.

A new form is one more row in the table that says what it does. The tests build a document around it, run it where it
can be run, and compare what is claimed of it.
"""

from __future__ import annotations

import re
from itertools import cycle, product
from typing import Any, NamedTuple

import pytest

from codegen.hfsm.document import Interface, Library, Text

__all__ = [
    "CHANGES", "COMMANDS", "COMMANDS_OF_TWO", "DRAWN_GUARDS", "HEADS", "HELPERS", "LEFT_BEHIND", "LIBRARIES", "MAY_CHANGE",
    "MAY_SEND", "SENDS", "SENDS_BY_ANY_NAME", "SENDS_BY_A_LIBRARY", "SENDS_NOTHING", "SPOKEN", "START", "STAYS", "VARIABLES",
    "Form", "Spoken", "assignments", "libraries_of", "with_functions",
]  # fmt: skip


class Form(NamedTuple):
    """A guard, or code of a state, with what is around it in its document."""

    text: str
    variables: str = ""
    functions: str = ""
    code: str = ""
    """Code of the state that a guard leaves."""
    library: str = ""
    """A library instead of `LIBRARIES`."""


LIBRARIES = tuple(
    Library(name=Text(name))
    for name in (
        *("bisect", "collections", "contextlib", "copy", "ctypes", "dataclasses", "functools", "heapq", "inspect", "io"),
        *("itertools", "math", "operator", "queue", "random", "re", "string", "sys", "threading", "types", "typing"),
        *("unittest.mock", "weakref", "from operator import attrgetter as find"),
        *("tests.support.gadgets as gadgets", "from tests.support.gadgets import Gadget, Number, gadget"),
    )
)  # fmt: skip


def libraries_of(*texts: str) -> tuple[Library, ...]:
    """Return the libraries that texts name."""
    words = set(re.findall(r"\w+", "\n".join(texts)))
    return tuple(each for each in LIBRARIES if words & set(re.findall(r"\w+", each.name.text)))


HEADS = (Interface(name="Head", type="PoseHead"), Interface(name="Neck", type="PoseHead"))

FUNCTIONS = """
def coin(self):
    return random.random() < 0.5

def often(self):
    return self.coin() or self.coin()

def fixed(self):
    return math.hypot(3.0, 4.0) > 4

def tick(self):
    self.ticks = getattr(self, "ticks", 0) + 1
    return self.ticks % 2 == 0

def every_third(self, counts=[0]):
    counts[0] += 1
    return counts[0] % 3 == 0

def take(self):
    if not hasattr(self, "left"):
        self.left = iter([True, False, False, True] * 99)
    return next(self.left)

def emit(self, who, name):
    who.send(name)

def shout(self):
    super().send("x")

class Holder:
    def __init__(self, component):
        self.component = component

    def notify(self):
        self.component.send("x")

class Toggle:
    def __init__(self):
        self.calls = 0

    def __bool__(self):
        self.calls += 1
        return self.calls % 2 == 0

    @property
    def value(self):
        return bool(self)

WORDS = ("decoy", "x")

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

def all_of(*those):
    those[0].send("x")

def alert(self, whom):
    whom.send("x")

@property
def belated(self):
    self.send("x")

def set_goal(self, goal):
    self.send(goal)
goal = property(None, set_goal)

class Noisy:
    def __eq__(self, other):
        other.send("x")
        return True

class Kind(type):
    def __instancecheck__(cls, one):
        one.send("x")
        return True
class Anything(metaclass=Kind):
    pass

def halt_all(*those):
    those[0].Head.stop()

def _set_aim(self, aim):
    self.Head.stop()
aim = property(None, _set_aim)

class Grip:
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

def same(self, value):
    return value
"""
"""What forms may call: a document has those that it names after a dot or in quotes, as others may let something escape."""


def with_functions(functions: str, *texts: str) -> str:
    """Return functions with those of `FUNCTIONS` that they or other texts name, and those that these name."""
    wanted: list[str] = []
    for _ in range(3):  # as deep as they name each other
        named = set(re.findall(r"[.\"'](\w+)", "\n".join([functions, *texts, *wanted])))
        wanted = [each for each in _DEFINITIONS if named & _names(each)]
    return "\n\n".join([functions, *wanted])


def _names(definition: str) -> set[str]:
    """Return the names that a definition gives."""
    return set(re.findall(r"^(?:def |class )?(\w+)(?:\(|:| =)", definition, re.MULTILINE))


_DEFINITIONS = re.split(r"\n\n(?=\S)", FUNCTIONS.strip())

SENDS_BY_ANY_NAME = [
    'self.send("x")',
    'me = self\nme.send("x")',
    'send = self.send\nsend("x")',
    "self.Holder(self).notify()",
    'self.emit(self, "x")',
    '(lambda c: c.send("x"))(self)',
    'def notify(c):\n    c.send("x")\nnotify(self)',
    'type(self).send(self, "x")',
    'getattr(self, "send")("x")',
    'getattr(self, "se" + "nd")("x")',
    'operator.methodcaller("send", "x")(self)',
    'operator.methodcaller("".join(["se", "nd"]), "x")(self)',
    'functools.partial(self.send, "x")()',
    '[c.send("x") for c in (self,)]',
    'eval("c.s" + "end(chr(120))", {"c": self})',
    'self._hfsm_send("x", None)',
    'name = "y"\nname, other = "x", "y"\nself.send(name)',
    'name = "y" if self is None else "".join("x")\nself.send(name)',
    "self.shout()",
    'getattr(self, "sh" + "".join("out"))()  # self.shout',
    "self.send.__self__.send(name='x')",
    '{"me": self}["me"].send(name="x")',
    'match self:\n    case object(send=notify):\n        notify("x")',
]
_FAILING = "try:\n    self.nothing\nexcept AttributeError as error:\n   "
_EVAL, _SELF, _TEXT = "'ev' + 'al'", "'_' + '_self_' + '_'", "'self.se' + 'nd(\"x\")'"
_HINT = "[a.send('x') for n in range(2, 9) if hasattr(a := sys._getframe(n).f_locals.get('self'), 'send')]"
_FRAME = "import sys\nsys._getframe(1).f_locals['self'].send('x')"
SENDS = [
    *SENDS_BY_ANY_NAME,
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
    # the component in a class
    'class Box:\n    who = self\nBox.who.send("x")',
    'class Box:\n    notify = self.send\nBox.notify("x")',
    'class Box:\n    class Inner:\n        who = self\nBox.Inner.who.send("x")',
    'class Box:\n    for who in (self,):\n        pass\nBox().who.send("x")',
    'me = self\nclass Box:\n    who = you = me\nBox.you.send("x")',
    'class Box(list):\n    pass\nBox([self]).pop().send("x")',
    # what is put into containers, and taken out again
    'w = ["decoy"]\nw[0] = "x"\nself.send(w[0])',
    'w = []\n[w][0].append("x")\nself.send(w[0])',
    'd = {"w": ""}\nd["w"] += "x"\nself.send(d["w"])',
    'w = []\nput = w.append\nput("x")\nself.send(w[0])',
    'w = ["decoy"]\nmax(w, ["a"]).insert(0, "x")\nself.send(w[0])',
    'w = []\ndef fill(*those):\n    those[0].append("x")\nfill(w)\nself.send(w[0])',
    'w = []\ndef fill(those):\n    those.append("x")\nfill(w)\nself.send(w[0])',
    'w = []\nlater = lambda: w\nlater().append("x")\nself.send(w[0])',
    'w = []\nheapq.heappush(w, "x")\nself.send(w[0])',
    'w = ["decoy"]\nfor w[0] in ["x"]: pass\nself.send(w[0])',
    'd = {}\nwith contextlib.nullcontext("x") as d["w"]: pass\nself.send(d["w"])',
    'w = [["decoy"]]\nfor row in (row for row in w): row[0] = "x"\nself.send(w[0][0])',
    'w = [["decoy"]]\nfor row in (row for row in w): row.insert(0, "x")\nself.send(w[0][0])',
    'w = []\nlist.append(w, "x")\nself.send(w[0])',
    'd = {}\noperator.setitem(d, "w", "x")\nself.send(d["w"])',
    'self.send(dict(w="x")["w"])',
    'self.send(dict([("w", "x")])["w"])',
    'first, *others = ["decoy", "x"]\nself.send(others[0])',
    'w = []\nw += ("x",)\nself.send(w[0])',
    'w = []\nw.extend(chr(120))\nself.send(w[0])',
    'd = {}\nd |= {"w": "x"}\nself.send(d["w"])',
    'd = {}\nd.setdefault("w", "x")\nself.send(d["w"])',
    'w = [*"x"]\nself.send(w[0])',
    'w = []\ntry:\n    raise ValueError(w)\nexcept ValueError as error:\n    error.args[0].append("x")\nself.send(w[0])',
    'w = []\nclass Box:\n    who = w\nBox.who.append("x")\nself.send(w[0])',
    'w = []\ncopy.copy([w])[0].append("x")\nself.send(w[0])',
    'w = []\nmatch [w]:\n    case [v]:\n        v.append("x")\nself.send(w[0])',
    'w = [[]]\nv = w + []\nv[0].append("x")\nself.send(w[0][0])',
    'w = [[]]\nv = w[:]\nv[0].append("x")\nself.send(w[0][0])',
    'w = [[]]\nv, = w\nv.append("x")\nself.send(w[0][0])',
    'w = [[]]\nnext(iter(w)).append("x")\nself.send(w[0][0])',
    'w = []\nd = {"w": w}\nd.get("w").append("x")\nself.send(w[0])',
    'w = []\n[*map(w.append, ["x"])]\nself.send(w[0])',
    'w = []\nself.w = w\nself.w.append("x")\nself.send(w[0])',
    'w = []\n(w if w is not None else 0).append("x")\nself.send(w[0])',
    'w = []\nrandom.choice([w]).append("x")\nself.send(w[0])',
    'w = []\nv = getattr(self, "none", w)\nv.append("x")\nself.send(w[0])',
    'w = []\nfor name, v in {"w": w}.items(): v.append("x")\nself.send(w[0])',
    'w = []\nfor v, n in zip([w], [1]): v.append("x")\nself.send(w[0])',
    'w = []\ndef keep(v=w):\n    v.append("x")\nkeep()\nself.send(w[0])',
    'w = []\ndef keep():\n    yield w\nfor v in keep(): v.append("x")\nself.send(w[0])',
    'w = ["x"]\nself.send(min(w, key=len))',
    'w = ["decoy"]\nw.sort(key=lambda _: w.__class__ and 0)\nw[:] = ["x"]\nself.send(w[0])',
    'w = ["decoy"]\ndel w[0]\nw.insert(0, "x")\nself.send(w.pop())',
    'def pick(word):\n    return word\nself.send(pick("x"))',
    'pick = lambda word: word\nself.send(pick("x"))',
    'def pick(word):\n    return word\nself.send([*map(pick, ["x"])][0])',
    'def pick(word):\n    word = [word]\n    return word\nself.send(pick("x")[0])',
    'def pick(w):\n    if w:\n        return "x"\nself.send(pick(1) or "decoy")',
    'self.send("X".lower())',
    'self.send(self.same(["x"])[0])',
    'self.send(self.same("x"))',
    # special attributes
    'self.send.__call__("x")',
    'notify = self.send.__call__.__call__\nnotify("x")',
    'make, given = self.send.__reduce__()\nmake(*given)("x")',
    "self.alert.__func__(self, self)",
    '(lambda: self.send("x")).__call__()',
    'getattr(self.send, "__call__")("x")',
    'self.__getstate__()["_hfsm_send"]("x", None)',
    # code that gets the component in passing
    "self.all_of()",
    'hasattr(self, "belated")',
    'self.goal = "x"',
    "text = f\"{1:{self.send('x') or 3}}\"",
    "self.Noisy() == self",
    "isinstance(self, self.Anything)",
    'ctypes.cast(id(self), ctypes.py_object).value.send("x")',
    'place = int(repr(self).split("0x")[1][:-1], 16)\nctypes.cast(place, ctypes.py_object).value.send("x")',
    'weakref.ref(self)().send("x")',
    'name = ""\nname += "x"\nself.send(name)',
    # attributes that are found by their names
    f"find = getattr\n{_FAILING} find(error, 'o' + 'bj').send('x')",
    f"import operator as o\n{_FAILING} o.attrgetter('o' + 'bj')(error).send('x')",
    f"import operator as o\nget = o.attrgetter\n{_FAILING} get('o' + 'bj')(error).send('x')",
    f"{_FAILING} find('o' + 'bj')(error).send('x')",
    f"from operator import attrgetter as get\n{_FAILING} get('o' + 'bj')(error).send('x')",
    f"{_FAILING} [*map(getattr, [error], ['o' + 'bj'])][0].send('x')",
    f"{_FAILING} getattr(*[error, 'o' + 'bj']).send('x')",
    f"find({_EVAL})(find({_SELF})(print))({_TEXT}) if self else 0",
    f"operator.methodcaller({_EVAL}, {_TEXT})(find({_SELF})(print)) if self else 0",
    f"string.Formatter().get_field('0.' + {_SELF} + '.' + {_EVAL}, [print], {{}})[0]({_TEXT}) if self else 0",
    f"match print:\n    case object(__self__=b):\n        match b:\n            case object(eval=e):\n                if self: e({_TEXT})",
    # a text that is run
    f"types.FunctionType(compile({_FRAME!r}, '', 'ex' + 'ec'), {{}})() if self else 0",
    f"def f(x: {_HINT}): pass\ntyping.get_type_hints(f) if self else 0",
    *(
        f"{_FAILING} {use}"
        for use in (
            "error.obj.send('x')",
            "getattr(error, 'obj').send('x')",
            "getattr(error, 'o' + error.name[:0] + 'bj').send('x')",
            "operator.attrgetter('obj.send')(error)('x')",
            "operator.attrgetter(error.name and 'obj')(error).send('x')",
            "match error:\n        case AttributeError(obj=found):\n            found.send('x')",
            "sys.exc_info()[1].obj.send('x')",
        )
    ),
]  # fmt: skip
"""Code that sends `x`, also in ways that no analysis follows: no proof denies it."""

SENDS_BY_A_LIBRARY = [
    *(Form(f"{name}(self.send, 'x')", library=f"from operator import call as {name}") for name in ("getattr", "print", "hasattr")),
    Form(
        "self.tell('x', 'x')", functions="@staticmethod\ndef tell(who, what, rest=None):\n    who.send(what)",
        library="from functools import cache as staticmethod",
    ),
]  # fmt: skip
"""Code that sends `x` by what has the name of a function of Python, and is another."""

MAY_SEND = [
    Form('getattr(self, "".join("foo"))'),
    Form("threading.current_thread()._args[0].send('x')"),
    Form("given = self.clock._agenda"),
    Form("sys.monitoring.register_callback(1, 2, print)"),
    Form("threading.setprofile_all_threads(print)"),
    Form("sys.addaudithook(print)"),
    Form("import logging.config as config\nconfig.dictConfig({'()': 'ext://' + 'operator.call'})"),
    Form("functools.singledispatch(print)"),
    Form("class Kind:\n    __match_args__ = '_' + '_self_' + '_',"),
]
"""Code that may reach the runtime. It does not run: some needs another Python, some changes what all tests use."""

SENDS_NOTHING = [
    Form('getattr(self, f"{n}Motors", None)', "n = 0"),
    Form("self.say(word='decoy', late='other')"),
    Form("class Sum:\n    def __init__(self):\n        self._sum = 0\nlast = Sum()._sum"),
    Form("place = collections.namedtuple('Place', 'x y')(1, 2)._replace(x=2)"),
    Form("x = sorted([], key=operator.attrgetter('place.x'))"),
    Form("x = [operator.methodcaller('lower')(each) for each in 'AB']"),
    Form("x = getattr(math, 'pi', 0) + getattr(math, f'{1:d}_pi', 0)"),
    Form("import re\nx = re.compile('a')"),
]
"""Code that a proof goes past."""


class Spoken(NamedTuple):
    """A text that code sends as an event, with what runs before it and after it, and the events that are known."""

    variables: str
    before: str
    text: str
    after: str
    events: set[str] | None = None
    """None where it may be any event."""


SPOKEN = [
    # values that are no texts, among texts
    Spoken("n = 0", "", 'f"{n}"', "n = 'last'"),
    Spoken("n = None", "", 'f"{n}"', "n = 'left'"),
    Spoken("n = b'y'", "", 'f"{n}"', "n = 'left'"),
    Spoken("self.n = 7", "", 'f"{self.n}"', "self.n = 'left'"),
    Spoken("k = True", "", "f\"{k or 'y'}\"", ""),
    Spoken("k = 0", "", "f\"{not k or 'y'}\"", ""),
    Spoken("k = 0", "", "f\"{'y' if k else 1}\"", ""),
    Spoken("n = 'left'", "", 'f"{(n := 3)}"', ""),
    # texts that are made
    Spoken("n = 'left'", "", 'f"{n!r}"', ""),
    Spoken("n = 'left'", "", 'f"{n:>5}"', ""),
    Spoken("n = 'left'", "", 'f"{(n,)}"', ""),
    Spoken("n = 'left'", "", '"%s" % n', ""),
    Spoken("n = 2", "", '"y" * n', ""),
    Spoken("n = 'left'", "", "n[::-1]", ""),
    Spoken("n = 'left'", "", "n.upper()", "", {"LEFT"}),
    Spoken("n = 'left'", "", '"-".join([n, n])', ""),
    Spoken("n = ['left']\nn[0] = ''.join('ab')", "", "n[0]", ""),
    Spoken("n = ['left']\nm = n\nm[0] = 'y'", "", "n[0]", "", {"left", "y"}),
    Spoken("n = ['left']\nn.append(f'{3 * 3}')", "", "n[-1]", ""),
    Spoken("n = {'a': 'left'}\nn.update(a='y')", "", "n['a']", ""),
    Spoken("n = ['left']", "def change(m):\n    m[0] = 'y'\nchange(n)", "n[0]", "", {"left", "y"}),
    Spoken("n = ['left', 'y']", "", "n[::-1][0]", "", {"left", "y"}),
    Spoken("n = [['left']]", "n[0][0] = 'y'", "n[0][0]", ""),
    Spoken("self.n = ['left']\ngetattr(self, 'n')[0] = 'y'", "", "self.n[0]", "", {"left", "y"}),
    Spoken("self.n = ['left']", "self.same(self.n)[0] = 'y'", "self.n[0]", "", {"left", "y"}),
    Spoken("n = 'left'", "", "self.same([n])[0]", "", {"left"}),
    Spoken("n = 'left'", "", "dict(word=n)['word']", ""),
    # unpacked and bound
    Spoken("", "a, b = {'left', 'y'}", "a", "", {"left", "y"}),
    Spoken("", "a, b = {'left': 1, 'y': 2}", "b", "", {"left", "y"}),
    Spoken("", "a, b = 'xy'", "a", ""),
    Spoken("", "a, *b = 'y', 'left'", "b[0]", "", {"left", "y"}),
    Spoken("", "[a] = [each for each in ['left']]", "a", "", {"left"}),
    Spoken("a = 'y'", "a += 'left'", "a", ""),
    Spoken("", "for a in 'xy':\n    pass", "a", ""),
    Spoken("", "for a in {**{'left': 1}}:\n    pass", "a", "", {"left"}),
    Spoken("", "for a in (*['left'],):\n    pass", "a", ""),
    Spoken("", "try:\n    raise KeyError('left')\nexcept KeyError as error:\n    a = error.args[0]", "a", ""),
    Spoken("", "match ['left']:\n    case [a]:\n        pass", "a", ""),
    Spoken("a = 'y'", "def bind():\n    nonlocal a\n    a = random.choice(['left'])\nbind()", "a", "", {"left", "y"}),
    Spoken("", "class Box:\n    a = 'left'", "Box.a", ""),
    Spoken("", "a = functools.partial(str, 'left')()", "a", ""),
    # shapes: the events that are sent are among those that are waited for
    Spoken("n = 'left'", "", 'f"{n=}"', "", {"n='left'"}),
    Spoken("n = 3", "", 'str(n) + "left"', "", {"3left"}),
    Spoken("n = 3", "n = n + 0", 'f"left{n}"', "", {"left3"}),
    Spoken("n = 3", "", '"left %d" % n', "", {"left 3"}),
    Spoken("n = [3.5]", "n.extend([])", 'f"{n[0]}, {n}"', "", {"3.5, [3.5]"}),
    # literals that nothing changes, and what functions return
    Spoken("n = 1", "", "self.WORDS[n]", "", {"decoy", "x"}),
    Spoken("n = ['left', 'y']\nk = 0", "", "n[k]", "k = 1", {"left", "y"}),
    Spoken("n = {1: 'left', 2: 'y'}", "", "n.get(1)", "", {"left", "y"}),
    Spoken("n = {1: 'left'}", "", "n.get(2, 'y')", "n[1] in 'left'", {"left", "y"}),
    Spoken("n = ('left', 'y')", "for a in n:\n    pass", "a", "", {"left", "y"}),
    Spoken("n = {'left': 1, 'y': 2}", "for a in n:\n    pass", "a", "", {"left", "y"}),
    Spoken("n = {1: 'left'}", "for _, a in n.items():\n    pass", "a", "", {"left"}),
    Spoken("n = ['left']", "for k, a in enumerate(n):\n    pass", "a", "len(n)", {"left"}),
    Spoken("n = [('left', 1), ('y', 2)]", "for a, k in n:\n    pass", "a", "", {"left", "y"}),
    Spoken("self.n = ['left', 'y']", "", "self.n[1]", "", {"left", "y"}),
    Spoken("n = ['left']", "", "random.choice(n)", "", {"left"}),
    Spoken("n = 'left'", "", "self.same(n)", "", {"left"}),
    # forms of the closed list
    Spoken("", "", '"y"', "", {"y"}),
    Spoken("n = 'left'", "", 'f"{n}-{n}"', "", {"left-left"}),
    Spoken("n = 'left'", "", '"to " + n', "n = 'right'", {"to left", "to right"}),
    Spoken("n = 'left'", "", "n if n else 'y'", "", {"left", "y"}),
    Spoken("n = None", "", "n or 'y'", "n = 'left'", {"left", "y"}),
    Spoken("self.n = 'left'", "", "self.n", "", {"left"}),
    Spoken("", "", "(n := 'left')", "", {"left"}),
    Spoken("", "a, b = 'left', 'y'", "b", "", {"y"}),
    Spoken("", "[a, b] = 'y', 'left'", "a", "", {"y"}),
    Spoken("", "for a in ('left', 'y'):\n    pass", "a", "", {"left", "y"}),
    Spoken("", "def bind():\n    nonlocal a\n    a = 'left'\nbind()", "a", "a = 'y'", {"left", "y"}),
    Spoken("", "me = self\nme.n = 'left'", "self.n", "", {"left"}),
    Spoken("", "a = [each for each in ('left', 'y')]", "'y'", "print(self, self.log)", {"y"}),
    Spoken("", "a = getattr(self, 'WORDS')", "'y'", "hasattr(self, 'WORDS')", {"y"}),
]  # fmt: skip

_FIELD = "asked = 0\n\n"
CHANGES = [
    Form("toggle", "toggle = self.Toggle()"),
    # objects of libraries, under any name and operator
    Form("gadget.pressed"),
    Form("gadgets.flag"),
    Form("gadget.pressed is True"),
    Form("gadgets.flag is True"),
    Form("self.is_true(gadget.pressed)", "", "def is_true(self, pressed):\n    return pressed is True"),
    Form("gadget[0]"),
    Form("1 in gadget"),
    Form("math.floor(gadget)"),
    Form("f'{gadget}' == 'True'"),
    Form("gadget.strip()"),
    Form("f'{1:{gadget + 2}}' == '  1'"),
    Form("True if gadget else False"),
    Form("abs(mine)", "mine = Gadget()"),
    Form("mine + 1 == 2", "first, mine = 1, gadget"),
    Form("mine > 3", "mine = random.uniform(Number(), Number())"),
    Form("mine > 3", "mine = random.gauss(Number(), Number())"),
    Form("mine == 'b'", "mine = str(Number())"),
    Form("mine == 'b'", "mine = f'{Number()}'"),
    Form("pair[1] > 3", "pair = (1, gadget)"),
    Form("pair == (1, 1)", "pair = (1, gadget)"),
    Form("-mine", "mine = (None or gadget)"),
    Form("mine", "mine = 0\nmine = copy.copy(gadget)"),
    Form("mine", "with contextlib.nullcontext(gadget) as mine: pass"),
    Form("mine", "match gadget:\n    case mine: pass"),
    Form("len(self.mine)", "self.mine = gadget"),
    Form("self.mine == 2", "for self.mine in [gadget]: pass"),
    Form("record.on", "record = dataclasses.make_dataclass('Record', ['on'])(gadget)"),
    Form("self.is_on(gadget)", "", "def is_on(self, device):\n    return device > 0.5"),
    Form("self.is_on()", "", "def is_on(self, device=gadget):\n    return bool(device)"),
    Form("self.find()", "", "def find(self):\n    found = gadget\n    return found"),
    Form("self.DEVICE", "", "DEVICE = gadget"),
    # attributes that a library assigns
    Form("self.on", "self.on = False\nunittest.mock.patch.object(self, 'on', gadget).start()"),
    Form(
        "self.is_on()",
        "unittest.mock.patch.object(type(self), 'is_on', lambda self: gadget.pressed).start()",
        "def is_on(self):\n    return False",
    ),
    # what is consumed
    Form("(*left,) == ()", "left = map(int, '12')"),
    Form("len([*left]) == 0", "left = (each for each in (1, 2))"),
    Form("self.is_done(*left)", "left = iter([1])", "def is_done(self, *rest):\n    return rest == ()"),
    Form("[*lines] == []", "lines = io.StringIO('a')"),
    Form("len(known) == 1 or known['x']", "known = collections.defaultdict(int)"),
    # attributes that run code
    Form(
        "self.on", "", _FIELD + "@property\ndef on(self):\n    self.asked += 1\n    return self.asked == 2"
    ),
    Form("self.on", "", "on = property(lambda self: gadget)"),
    Form("self.on", "type(self).on = property(lambda self: gadget)"),
    Form("self.on", "kind = self.__class__\nkind.on = property(lambda self: gadget.pressed)"),
    Form("self.on", "", "def __getattr__(self, name):\n    return gadget.pressed"),
]  # fmt: skip
"""Guards that do not hold the first time and hold the second."""

_REPLACED = [
    "math.floor = gadget",
    "math.floor, other = gadget, 1",
    "for math.floor in [gadget]: pass",
    "with contextlib.nullcontext(gadget) as math.floor: pass",
    "numbers = math\nnumbers.floor = gadget",
    "del math.floor",
    "math.pi = gadget",
    "def put(self):\n    self.floor = gadget\nput(math)",
]
MAY_CHANGE = [
    Form("self.on", "self.on = False\ndef turn():\n    self.on = True\nlater = threading.Timer(9, turn)"),
    Form("self.on", "self.on = False\nlater = lambda: self.turn()", "def turn(self):\n    self.on = True"),
    Form("n > 0", "n = 0\ndef turn():\n    nonlocal n\n    n += 1\nlater = threading.Timer(9, turn)"),
    Form("pose.pan > 0", "pose = None", code="pose = self.Head.getPose()\npose.pan = 3"),
    Form("pose.pan > 0", "pose = None", code="pose = self.Head.getPose()\nself.pose = pose"),
    Form("pose[0] > 0", "pose = None", code="pose = self.Head.getPose()\npose.sort()"),
    Form("pose[0] > 0", "pose = None", code="pose = self.Head.getPose()\nother = pose\nother[0] += 1"),
    Form("pose[0] > 0", "pose = None", code="pose = self.Head.getPose()\nsort = pose.sort\nsort()"),
    Form("pose[0] > 0", "pose = None", code="pose = self.Head.getPose()\nlater = [pose]"),
    Form("n[0]", "n = [1]", code="n[0] = 2"),
    Form("n[0]", "n = [1]\nm = n"),
    Form("n[0]", "n = [1]\nlater = threading.Timer(9, n.clear)"),
    Form("self.n[0]", "self.n = [1]\nm = getattr(self, 'n')"),
    Form("n in m", "n = 1\nm = [1]", code="m.append(n)"),
    Form("self.safe()", functions="def safe(self):\n    try:\n        return gadget.pressed\n    except ValueError as error:\n        return error"),
    Form("self.odd()", functions="def odd(self):\n    match gadget:\n        case 1:\n            return True\n    return False"),
    Form("n['a'] > 1", "n = {'a': 1}\nn |= {'a': 2}"),
    Form("n in m", "n = 1\nm = iter([1])"),
    Form("self.n > 0", "self.n = 1\nsetattr(self, 'n', 2)"),
    Form("n", "n = queue.SimpleQueue()"),
    Form("math.floor(n) > 0", "n = 1\nnumbers = math\nnumbers.floor = max"),
    Form("self.is_on()", "", "def is_on(self, asked=[]):\n    asked.append(1)\n    return len(asked) > 1"),
    Form("self.is_on(*n)", "n = iter([1])", "def is_on(self, *n):\n    return n"),
    Form("isinstance(n, Kind)", "n = 1\nclass Kind:\n    pass"),
    Form("(lambda: n)()", "n = 1"),
    Form("[each for each in (n,)] == []", "n = 1"),
    Form("bool(self.later)", "self.later = threading.Timer(9, self.turn)", "def turn(self):\n    pass"),
    Form("self.Head.getPose().pan > 0"),
    Form("count.last is None", "def count(): pass\ncount.last = None"),
    Form(
        "n > 1",
        "n = 1\nlater = ((n := each) for each in (1, 2))\nself.lists(later)",
        "def lists(self, given):\n    pass",
    ),
    *(Form(f"{name} > 3", library=f"from numpy import {name}_ as {name}") for name in ("bool", "float", "int", "str")),
    *(Form("math.pi > 0" if "pi" in each else "math.floor(n) > 0", f"n = 1\n{each}") for each in _REPLACED),
    *(
        Form(
            "math.pi > 0" if "pi" in each else "math.floor(n) > 0",
            "n = 1\nself.replace()",
            "def replace(self):\n    " + each.replace("\n", "\n    "),
        )
        for each in _REPLACED
    ),
]  # fmt: skip
"""Guards that may answer otherwise when they are asked again. They do not run: it is luck, or changes what others need."""

STAYS = [
    Form("self.fixed()"),
    Form("n > 3", "n = 0"),
    Form("math.sin(n) > 0.5", "n = 0"),
    Form("n is None", "n = 0"),
    Form("n > 3", "n = 0"),
    Form("n % 2 == 0", "n = 0\nn += 1"),
    Form("name.lower().startswith('b')", "name = 'ball'"),
    Form("math.hypot(*place) < 2 * math.pi", "place = (1.5, 2.0)"),
    Form("place[0] > place[1]", "place = (1.5, -2.0)"),
    Form("since is None", "since = gadget"),
    Form("since > 3", "since = self.clock.now()"),
    Form("abs(error) < 0.1", "error = math.atan2(1, 2) - 0.5 * 3"),
    Form("turn > 0.5", "turn = float(gadget) if gadget else 0"),
    Form("near", "near = float(gadget) < 0.5"),
    Form("pan > 0.5", "pan = self.Head.getPose().pan"),
    Form("self.mine > 3", "self.mine = 4"),
    Form("self.speed > 0.5"),
    Form("goal > 0.5"),
    Form("self.near(n)", "n = 2", "def near(self, distance, most=3):\n    return distance < most"),
    Form("isinstance(n, int)", "n = 2"),
    Form("seen", "seen = not gadget"),
    Form("mode is gadgets.MODE", "mode = None"),
    Form("n[0]", "n = [1]"),
    Form("n[k] > 1", "n = {1: 2, 3: 4}\nk = 1"),
    Form("n in m", "n = 1\nm = ['a', 1]"),
    Form("self.n[0] > 2", "self.n = (1, 2)"),
    Form(
        "self.safe(n)",
        "n = 2",
        "def safe(self, n):\n    try:\n        return 1 / n > 0.3\n    except ZeroDivisionError:\n        return False",
    ),
    Form(
        "self.odd(n)",
        "n = 2",
        "def odd(self, n):\n    match n:\n        case 1 | 3:\n            return True\n        case _:\n            return False",
    ),
    Form(
        "self.far(n)",
        "n = 2",
        "def far(self, distance):\n    if distance > 3:\n        return True\n    return False",
    ),
]
"""Guards that answer the same when they are asked again."""

VARIABLES = {
    "toggle": "toggle = self.Toggle()",
    "items": "items = [True, False] * 99",
    "draw": "draw = iter([True, False] * 99)",
    "n": "n = 0",
}
DRAWN_GUARDS = [
    "self.coin()", "not self.coin()", "self.often()", "self.tick()", "not self.tick()", "self.every_third()",
    "not self.every_third()", "self.take()", "not self.take()", "self.fixed()", "not self.fixed()", "bool(toggle)",
    "toggle", "not toggle", "toggle.value", "items.pop()", "not items.pop()", "next(draw)", "not next(draw)",
    "True in draw", "not (True in draw)", "(n := n + 1) % 3 == 0", "n % 3 == 0", "not (n % 3 == 0)",
    "random.random() < 0.5", "not (random.random() < 0.5)", "any(draw)", "len(items) % 2", "not len(items) % 2",
    "self.coin() and not self.coin()", '"a" == b"a"', "return self.tick()", "self.ticks > 3",
]  # fmt: skip
"""Guards, some of which draw lots or change, and the variables of some."""

HELPERS = """
HELPERS = True

def nod(self, who, *others):
    who.setSpeed(0.1, 0.0)
    for other in others:
        other.stop()

def turn(self, side):
    getattr(self, side).setPose(0.0, 0.0, 0.5)

def keep(self):
    global kept
    kept = self.Head

def store(self, head):
    global kept
    kept = head

def kept(self):
    kept.stop()

def toggle(self):
    self.count = getattr(self, "count", 0) + 1
    (self.Head if self.count % 2 else self.Neck).stop()

def choose(self):
    return self.Neck if self.sides else self.Head

class Holder:
    def __init__(self, component):
        self.component = component

    def move(self):
        self.component.Head.stop()

def inside(self):
    eval("self.Neck.stop()")

@property
def late(self):
    self.Head.stop()

@staticmethod
def still(proxy):
    proxy.stop()

if HELPERS:
    def hidden(self):
        self.Neck.stop()
"""
START = """
self.mine = self.Head
self.sides = ["Head", "Neck"]
shared = self.Neck
"""
COMMANDS_OF_TWO = [
    "self.Head.setPose(0.0, 0.0, 0.2)", "self.Neck.stop()", "self.Head.getPose()", "head = self.Head\nhead.stop()",
    "turn = self.Neck.setSpeed\nturn(0.1, 0.0)", "me = self\nme.Head.stop()", "self.mine.stop()", "shared.stop()",
    "self.nod(self.Head)", "self.nod(who=self.Neck)", "self.nod(self.Head, self.Neck)", 'self.turn("Neck")',
    "self.nod(*[self.Neck])", 'self.turn(random.choice(["Head"]))', "self.toggle()", "self.choose().stop()",
    "self.Holder(self).move()", "(lambda head: head.stop())(self.Head)", "[each.stop() for each in (self.Head, self.Neck)]",
    'side = "He"\nself.turn(f"{side}ad")', 'for side in self.sides:\n    getattr(self, side).stop()',
    "{1: self.Head}[1].stop()", "functools.partial(self.Neck.stop)()", 'vars(self)["mine"].stop()',
    "first, second = self.Head, self.Neck\nsecond.stop()", "def go(h):\n    h.stop()\ngo(self.Neck)",
    'operator.methodcaller("stop")(self.Head)', 'operator.attrgetter("Head")(self).stop()', "",
    'setattr(self, "late", self.Neck)\nself.late.stop()', "head = None\nhead = head or self.Head\nhead.stop()",
    "with contextlib.nullcontext(self.Head) as head:\n    head.stop()", "self.Head.__class__.stop(self.Head)",
    "self.keep()\nself.kept()", "self.store(head := self.Neck)\nself.kept()",
    "for self.each in (self.Head, self.Neck):\n    self.each.stop()", "global h\nh = self.Head\nh.stop()",
]  # fmt: skip
"""Code of an automaton beside another, which commands the head, the neck, both or none."""

GRIP = "grip = self.Grip(self.Head)"
COMMANDS = [
    # proxies that a proxy makes
    Form("self.Head.ice_invocationTimeout(100).stop()"),
    Form("self.Head.ice_invocationTimeout(100).ice_invocationTimeout(200).stop()"),
    Form("head.stop()", "head = self.Head.ice_invocationTimeout(100)"),
    Form("self.quick.stop()", "self.quick = self.Head.ice_invocationTimeout(100)"),
    Form('getattr(self.Head, "ice_invocationTimeout")(100).stop()'),
    Form("make = self.Head.ice_invocationTimeout\nmake(100).stop()"),
    # special attributes, and a proxy in a class
    Form("self.Head.stop.__call__()"),
    Form("self.Head.__class__.stop(self.Head)"),
    Form("class Box:\n    head = self.Head\nBox.head.stop()"),
    Form("class Box:\n    stop = self.Head.stop\nBox.stop()"),
    # code that gets the proxy in passing
    Form("self.halt_all()"),
    Form("self.aim = 3"),
    Form("not grip", GRIP),
    Form('text = f"{grip}"', GRIP),
    Form("grip += 1", GRIP),
    Form("first = [*grip]", GRIP),
    Form("with grip: pass", GRIP),
    Form("now = grip.angle", GRIP),
    Form("grip.angle = 3", GRIP),
]
"""Code that commands the head."""

LEFT_BEHIND = [
    ("def turn():\n    self.Head.stop()", "turn()"),
    ("turn = lambda: self.Head.stop()", "turn()"),
    ("turn = self.Head.stop", "turn()"),
    ("self.turn = lambda: self.Head.stop()", "self.turn()"),
    ("helpers = [self.Head]", "helpers[0].stop()"),
    ("helper = self.Holder(self)", "helper.move()"),
    ("global kept\nkept = self.Head", "self.kept()"),
    ("global go\ndef go():\n    self.Head.stop()", "go()"),
    ("class Helper:\n    def move(me):\n        self.Head.stop()\nhelper = Helper()", "helper.move()"),
    ('name = "Head"', "getattr(self, name).stop()"),
]
"""What code of one state leaves to that of another, which commands the head."""

_PLACES = [
    "{target} = {value}",
    "first = {target} = {value}",
    "for {target} in [{value}]: pass",
    "for {target} in iter([{value}]): pass",
    "for count, {target} in enumerate([{value}]): pass",
    'for key, {target} in {{"key": {value}}}.items(): pass',
    "for one, {target} in zip('a', [{value}]): pass",
    "with contextlib.nullcontext({value}) as {target}: pass",
    "with contextlib.nullcontext(1), contextlib.nullcontext({value}) as {target}: pass",
    "try:\n    raise ValueError({value})\nexcept ValueError as error:\n    ({target}), = error.args",
    "match {value}:\n    case {pattern}: pass",
    "match [{value}, 1]:\n    case [{pattern}, *_]: pass",
    'match {{"key": {value}}}:\n    case {{"key": {pattern}}}: pass',
]
"""Where a value is assigned; those with a pattern assign to no attribute."""
_TARGETS = [
    ("{}", "{}", "{}"),
    ("(one, {},)", "[1, {}]", "[_, {}]"),
    ("[{}, two, *rest,]", "[{}, 2, 7, 8]", "[{}, _, *_]"),
    ("(one, [two, {}, three,],)", "[1, [2, {}, 3]]", "[_, [_, {}, _]]"),
    ("[[{}, *rest,], one,]", "[[{}, 7, 8], 1]", "[[{}, *_], _]"),
]
"""What it is assigned to, a value that fits, and the same target as a pattern."""
_VALUES = [
    "{}",
    "self.same({})",
    "copy.copy({})",
    "[{}][0]",
    '{{"key": {}}}["key"]',
    "next(itertools.chain([{}]))",
]


def assignments(value: str) -> tuple[list[Any], list[Any]]:
    """Return names, some of which are attributes, with code that gives them a value: each place once, and others."""

    def written(place: str, targets: tuple[str, str, str], way: str) -> Any:
        target, given, pattern = targets
        name = "n" if "{pattern}" in place or _PLACES.index(place) % 2 else "self.n"
        filled = {"target": target.format(name), "pattern": pattern.format(name)}
        return pytest.param(name, place.format(**filled, value=way.format(given.format(value))))

    few = [*zip(_PLACES, cycle(_TARGETS), cycle(_VALUES), strict=False)]
    others = [each for each in product(_PLACES, _TARGETS, _VALUES) if each not in few]
    return [written(*each) for each in few], [written(*each) for each in others[::7]]
