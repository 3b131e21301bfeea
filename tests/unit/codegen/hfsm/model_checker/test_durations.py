"""Code that may take longer than a period leaves the order of timers open."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from codegen.hfsm.analysis import analyze
from codegen.hfsm.document import Document, Functions, Library, Text
from codegen.hfsm.model_checker import Reachability, Verdict, check_model
from codegen.hfsm.model_checker._durations import slow_code
from tests.support.model_documents import PATH, after, automaton, document, finished, on, state, stated, when

LATE = after(800, 1, 2, priority=1, id=1)
EARLY = after(500, 1, 3, id=2)


def timed(code: str, functions: str = "", libraries: tuple[str, ...] = (), **others: str) -> Document:
    """Return a document in which one timer expires long before another one of a higher priority."""
    states = [state(1, code=code), state(2, "b"), state(3, "c")]
    variables = Text(others.get("variables", ""))
    made = document(
        automaton(1, states, [LATE, EARLY], functions=Text(functions), variables=variables),
        properties=[stated("never", "b"), stated("eventually", "c", "1000")],
    )
    return replace(made, libraries=tuple(Library(name=Text(name)) for name in libraries))


SLOW = {
    "sleep": "self.sleep(d)",
    "a short sleep, of several": "self.sleep(0.01)",
    "sleep by name": 'getattr(self, "sleep")(1)',
    "sleep by a computed name": 'getattr(self, "sl" + "eep")(1)',
    "an f-string": 'getattr(self, f"{x}eep")(1)',
    "an alias": "nap = self.sleep\nnap(1)",
    "the clock": "self.clock.sleep(1)",
    "a bound method that is passed on": "list(map(self.sleep, [1]))",
    "time": "import time\ntime.sleep(1)",
    "time by another name": "import time as t\nt.sleep(1)",
    "from time": "from time import sleep as nap\nnap(1)",
    "an event": "import threading\nthreading.Event().wait(1)",
    "a lock": "lock.acquire()",
    "a lock as a context": "with lock:\n    pass",
    "a queue": "queue.get()",
    "a queue with a limit": "queue.get(timeout=1)",
    "a thread": "thread.join()",
    "a thread with a limit": "thread.join(1.5)",
    "a thread with a limit that is computed": "import threading\nthread.join(max(0, end - now))",
    "a thread with a limit by name": "import threading\nthread.join(limit)",
    "a wait by another name": "wait = ready.wait\nwait(1)",
    "a wait for the component's sample by another name": "first = self.Head.getPose.wait\nfirst(timeout=1)",
    "a wait for the component's lock that is passed on": "list(map(self.lock.acquire, [True]))",
    "samples by another name": "arrive = self.Head.getPose.samples\nfor sample in arrive():\n    pass",
    "a lock that is passed on": "list(map(lock.acquire, [True]))",
    "a wait by its name": "getattr(ready, 'wait')(1)",
    "a wait by its name, for a library": "import operator\noperator.methodcaller('wait', 1)(ready)",
    "a lock that a function returns": "import threading\nwith self.lock_of(1):\n    pass",
    "a semaphore": "import threading\nwith threading.Semaphore(0): pass",
    "a lock that a function of Python returns": "import threading\nwith next(iter([lock])): pass",
    "a lock that a library returns": "import random, threading\nwith random.choice(locks): pass",
    "a socket of a log": "import logging\nlogging.handlers.SocketHandler('x', 1).emit(record)",
    "a lock that is entered": "lock.__enter__()",
    "standard input": "import sys\nfor line in sys.stdin:\n    pass",
    "standard input by name": "from sys import stdin\nx = stdin.read()",
    "a person, by the module": "import builtins as b\nb.input()",
    "a future": "self.Head.setPoseAsync(0).result()",
    "the failure of a call": "error = self.Head.setPose.begin(0).exception()",
    "the failure of a call, with a limit": "error = moving.exception(timeout=limit)",
    "samples": "for sample in self.Head.getPose.samples():\n    pass",
    "the next message": "scan = self.scan.next(timeout=2.0)",
    "a busy loop": "import time\nwhile time.time() < end:\n    pass",
    "a loop without an end": "import itertools\nfor n in itertools.count():\n    if time() > end: break",
    "another one": "from itertools import repeat as again\nany(time() > end for _ in again(0))",
    "a loop until a value comes": "for _ in iter(self.busy, False):\n    pass",
    "until a value comes, in one expression": "values = list(iter(self.busy, None))",
    "a loop without an end, numbered": "import itertools\nfor n, led in enumerate(itertools.cycle(leds)): pass",
    "a loop over a name without an end": "import itertools\nids = itertools.count()\nfor n in ids: pass",
    "an attribute without an end": "import itertools\nself.ids = itertools.count()\nfor n in self.ids: pass",
    "numbers without an end side by side": "import itertools as i\nfor n in zip(i.count(), i.count()): pass",
    "an end that a function finds": "import itertools\nany(map(self.busy, itertools.repeat(0)))",
    "the first that a function lets pass": "import itertools\nnext(filter(self.busy, itertools.count()))",
    "a generator without an end": "import itertools\ndef f():\n    yield from itertools.count()\nfor n in f(): pass",
    "an iterator of its own": "class A:\n    def __next__(self):\n        return 1\nfor n in A(): pass",
    "what is in numbers without an end": "import itertools\nx = -1 in itertools.count()",
    "all numbers without an end": "import itertools\nx = [*itertools.count()]",
    "one of two that has no end": "import itertools\na, b = itertools.count(), 1\nfor x in a: pass",
    "a product without an end": "import itertools, math\nx = math.prod(itertools.repeat(1))",
    "numbers without an end by another name": "import itertools\nc = itertools.count\nfor x in c(): pass",
    "numbers without an end from a list": "import itertools\na = [itertools.count()]\nfor x in a[0]: pass",
    "numbers without an end from a function": "import itertools\nx = (lambda: itertools.count())()",
    "numbers without an end that are chosen": "import itertools\nfor x in itertools.count() if y else z: pass",
    "numbers without an end but the first": "import itertools\nx = set(itertools.islice(itertools.count(), 1, None))",
    "numbers that get a name first": "b = a\nfor x in b: pass\nimport itertools\na = itertools.count()",
    "an item of its own": "class A:\n    def __getitem__(self, n):\n        return n\nfor n in A(): pass",
    "an iterator of its own, by name": "class A:\n    __next__ = f\nfor n in A(): pass",
    "an iterator of its own, by text": "for n in type('A', (), {'__next__': f})(): pass",
    "a timer that runs here": "import threading\nthreading.Timer(9, print).run()",
    "a timer that runs here by another name": "import threading\nwait = threading.Timer(9, print).run\nwait()",
    "standard input, of a module by another name": "import sys\ns = sys\nx = s.stdin.read()",
    "standard input by the name of an attribute": "import sys\nx = getattr(sys, 'stdin').read()",
    "a person, by the module by another name": "import builtins\nb = builtins\nb.input()",
    "a person, by what belongs to a function": "print.__self__.input()",
    "a person, by the name of an attribute": "getattr(print, '__self__').input()",
    "a person, by a pattern": "match print:\n    case object(__self__=b): x = b",
    "a person, by the names of the file": "__builtins__['input']()",
    "a person, by the modules": "import sys\nsys.modules['builtins'].input()",
    "a future by another name": "end = self.Head.setPoseAsync(0).result\nend()",
    "the failure of a call by another name": "error = moving.exception\nerror()",
    "the next message by another name": "scan = self.scan.next\nscan(timeout=2)",
    "a wait that another function finds": "find = getattr\nfind(ready, 'wait')()",
    "a wait that a renamed function finds": "from operator import methodcaller as call\ncall('wait', 1)(ready)",
    "a wait that is found for all": "x = list(map(getattr, [ready], ['wait']))",
    "a wait of another `self`": "def f(self):\n    w = self.wait\n    w()\nf(ready)",
    "a process, by a module in a module": "import logging\nlogging.os.system('sleep 9')",
    "a process, by a module in another one by another name": "import uuid\nu = uuid\nu.os.system('sleep 9')",
    "a library with the name of another": "import requests as r\nr.get('x')\ndef f():\n    import math as r",
    "a loop until a value comes, by another name": "until = iter\nfor _ in until(self.busy, False): pass",
    "numbers without an end, of a module by another name": "import itertools\ni = itertools\nx = max(i.count())",
    "numbers without an end by their name": "import itertools\nx = max(getattr(itertools, 'count')())",
    "what a module keeps to itself": "import threading\nthreading._shutdown()",
    "threads that are passed on": "import threading\nlist(map(threading.Thread.join, threads))",
    "a thread by another name": "import threading\nend = thread.join\nend()",
    "a lock by a computed name": "getattr(lock, f'acq{rest}')()",
    "a lock by an unknown name": "import operator\noperator.attrgetter(name)(lock)()",
    "a window by another name": "import cv2\nwait = cv2.waitKey\nwait(0)",
    "a window by the name of its function": "from cv2 import waitKey as wait\nlist(map(wait, [0]))",
    "a rectangle that a person draws": "import cv2\nx = cv2.selectROI('ball', image)",
    "a person who reads": "help(self)",
    "standard input as it was at first": "import sys\nx = sys.__stdin__.read()",
    "a person": "input()",
    "a process": "import subprocess\nsubprocess.run(['ls'], timeout=1)",
    "the web": "import requests\nrequests.get('http://x', timeout=1)",
    "a library that is not known": "import mylib\nmylib.compute()",
    "an object of a library": "from mylib import camera\nc = camera\nc.read()",
    "an attribute in a library": "import mylib\nx = mylib.camera.frame",
    "a loop over an object of a library": "from mylib import camera\nfor frame in camera: pass",
    "a library by another name": "import mylib\nlib = mylib\nlib.camera.read()",
    "a class that extends one of a library": "from mylib import Camera\nclass C(Camera): pass\nC().read()",
    "a window": "import cv2\ncv2.waitKey(0)",
    "code as a text": "exec(text)",
    "a lambda": "f = lambda: self.sleep(1)\nf()",
    "a class": "class A:\n    nap = self.sleep\nA.nap(1)",
}

QUICK = {
    "nothing": "",
    "a servant": "self.Head.setPose(0.1, 0.2)",
    "a log": 'self.log.info("%s", ", ".join(["a"]))',
    "an exception in a log": "try:\n    x = 1 / y\nexcept ZeroDivisionError:\n    self.log.exception('y is 0')",
    "an event": 'self.send("go")',
    "computing": "import math\nx = math.hypot(1, 2)\nfor i in range(3):\n    x += i",
    "images": "import cv2\nimport numpy as np\ny = cv2.inRange(np.zeros(3), 0, 1)",
    "a dictionary": 'x = {"a": 1}.get("a")\ny = d.get("b", 2)',
    "a text": "x = separator.join(words)",
    "a text beside threads": "import threading\nx = separator.join([word for word in words])",
    "a text of a call beside threads": "import threading\nx = separator.join(map(str, words))",
    "a file beside threads": "import threading\nwith open(name) as file:\n    x = file.read()",
    "a library's context beside threads": "import numpy as np, threading\nwith np.errstate(all='ignore'):\n    x = 1",
    "a time to wait": "x = self.clock.now() - since > self.wait",
    "a computed proxy": 'getattr(self, f"{side}Motors").setPose(1)',
    "numbers": "import itertools\nids = itertools.count()\nfor n, x in zip(ids, iter(words)):\n    pass",
    "some of many numbers": "import itertools\nfor n in itertools.islice(itertools.count(), 3):\n    pass",
    "one of many numbers": "import itertools\nids = itertools.count()\nfor n in range(next(ids)):\n    pass",
    "an attribute by its name": "import operator\nx = sorted(words, key=operator.attrgetter('place.x'))",
    "a method by its name": "import operator\noperator.methodcaller('rotate', angle)(image)",
    "a text of many lines beside threads": "import threading\nlines = list(map(', '.join, rows))",
    "the next of some names": "import itertools\nx = next(map(str, iter(itertools.cycle(names))))",
    "names in turn": "import itertools\nself.names = itertools.cycle(['a', 'b'])\nx = next(self.names)",
    "names and numbers": "import itertools\nx = dict(zip(names, itertools.count(1)))",
    "a result of its own": "self.result = 3\nx = self.result",
    "a run": "robot.run()",
    "a class": "class A:\n    def __init__(self):\n        self._sum = 0\nx = A()._sum",
    "a version": "import numpy as np\nx = np.__version__",
    "an attribute of a known end": "x = getattr(y, f'{side}_motor')",
    "the newest message": "scan = self.scan.latest()\nx = next(numbers, 0)",
    "a constant of a library": "import mylib\nx = mylib.SPEED",
    "a class of a library": "import mylib\nx = isinstance(y, (int, mylib.Ball))",
    "an error of a library": "import mylib\ntry:\n    x = 1\nexcept mylib.Error:\n    x = 2",
    "the environment": "import os\nx = os.environ['HOME']",
    "the time": "import time\nx = time.monotonic()",
    "a file": "with open('x') as file:\n    x = file.read()",
}


@pytest.mark.parametrize("code", SLOW.values(), ids=SLOW)
def test_code_that_may_wait_leaves_the_order_of_timers_open(code: str) -> None:
    report = check_model(timed(code), PATH)
    assert [each.reachability for each in report.transitions if each.transition == LATE.id] == [
        Reachability.UNDECIDED
    ]
    assert [each.verdict for each in report.properties] == [Verdict.UNDECIDED] * 2
    assert not report.complete
    assert any("longer than a period" in note.message for note in report.doubtful)


@pytest.mark.parametrize("code", QUICK.values(), ids=QUICK)
def test_other_code_leaves_proofs_as_they_are(code: str) -> None:
    report = check_model(timed(code), PATH)
    assert [each.verdict for each in report.properties] == [Verdict.HOLDS] * 2
    assert report.complete


@pytest.mark.parametrize(
    "made",
    [
        timed("self.nap()", functions="def nap(self):\n    self.sleep(1)"),
        timed("nap()", variables="import time\nnap = lambda: time.sleep(1)"),
        timed("nap(1)", libraries=("from time import sleep as nap",)),
        timed("wait_long(1)", libraries=("from mylib import *",)),
        timed("camera.read()", libraries=("from mylib import *",)),
        timed("x = max(count())", libraries=("from itertools import *",)),
        timed("x = stdin.read()", libraries=("from sys import *",)),
        timed("get('x')", libraries=("from requests import *", "from math import *")),
        timed("open('x')", libraries=("from os import *",)),
        timed("self.camera.read()", functions="from mylib import camera\ndef f(self):\n    pass"),
        timed("lib.camera.read()", variables="import mylib as lib"),
        replace(timed("self.nap()"), functions=(Functions(text=Text("def nap(me):\n    me.sleep(1)")),)),
    ],
    ids=[
        *("function", "variables", "library", "import *", "import * of an object"),
        *("import * of numbers", "import * of an input", "two import *", "import * of what Python has"),
        *("import among functions", "import in variables", "function of the component"),
    ],
)
def test_functions_and_libraries_are_followed(made: Document) -> None:
    assert [each.verdict for each in check_model(made, PATH).properties] == [Verdict.UNDECIDED] * 2


def test_a_function_of_the_document_may_be_called_sleep() -> None:
    made = timed("self.sleep()", functions="def sleep(self):\n    pass")
    assert [each.verdict for each in check_model(made, PATH).properties] == [Verdict.HOLDS] * 2


@pytest.mark.parametrize("part", ["entry", "code", "exit", "guard", "fired"])
def test_a_parent_that_may_wait_leaves_the_timers_below_it_open(part: str) -> None:
    slow = {"entry": "", "code": "", "exit": "", "guard": "", "fired": "", part: "self.sleep(3)"}
    way = after(1000, 1, 2, slow["guard"], code=slow["fired"])
    parts = {key: slow[key] for key in ("entry", "code", "exit")}
    outer = automaton(1, [state(1, "P", children=[2], **parts), state(2, "Q")], [way])
    inner = automaton(2, [state(1, "a"), state(2, "c")], [after(2000, 1, 2)], father=1)
    (result,) = check_model(document(outer, inner, properties=[stated("never", "P/c")]), PATH).properties
    assert result.verdict is not Verdict.HOLDS


def test_a_cycle_may_be_missed_in_which_a_guard_would_have_fired() -> None:
    outer = automaton(
        1,
        [state(1, "P", children=[2, 3]), state(2, "Q")],
        [finished(1, 2)],
    )
    ends = automaton(
        2, [state(1, code="self.sleep(1)"), state(2, final=True)], [when("True", 1, 2)], father=1
    )
    goes_on = automaton(3, [state(1, "a"), state(2, final=True), state(3, "c")],
                        [when("True", 1, 2), after(100, 1, 3, priority=1)], father=1)  # fmt: skip
    made = document(outer, ends, goes_on, properties=[stated("never", "P/c")])
    assert check_model(made, PATH).properties[0].verdict is Verdict.UNDECIDED


@pytest.mark.parametrize(
    ("part", "expression"),
    [
        ("exit", "a -> active(a)"),
        ("fired", "b -> active(b)"),
        ("entry", "b -> active(b)"),
        ("entry", "ghost(a) and ghost(b) -> c"),
        ("final", "c -> finished(#1)"),
    ],
)
def test_others_see_a_change_that_lasts_before_its_end(part: str, expression: str) -> None:
    slow = {"exit": "", "fired": "", "entry": "", "final": "", part: "self.sleep(3)"}
    states = [
        state(1, "a", children=[2], exit=slow["exit"]),
        state(2, "b", children=[3], entry=slow["entry"]),
        state(3, "c", final=True, entry=slow["final"]),
    ]
    outer = automaton(1, states, [after(200, 1, 2, code=slow["fired"]), after(300, 2, 3)])
    inner = [automaton(2, [state(1)], father=1), automaton(3, [state(1)], father=1)]
    made = document(outer, *inner, properties=[stated("always", expression)])
    assert check_model(made, PATH).properties[0].verdict is Verdict.UNDECIDED


@pytest.mark.parametrize("within", ["100", ""])
def test_an_entry_may_last(within: str) -> None:
    outer = automaton(1, [state(1, "a", children=[2], entry="while not self.found:\n    self.sleep(1)")])
    inner = automaton(2, [state(1, final=True)], father=1)
    coming = [stated("eventually", f"{what}(#2)", within) for what in ("active", "finished")]
    made = document(outer, inner, properties=[*coming, stated("eventually", "a", within)])
    expected = [Verdict.UNDECIDED, Verdict.UNDECIDED, Verdict.HOLDS]
    assert [each.verdict for each in check_model(made, PATH).properties] == expected


def test_what_no_timer_decides_is_still_proved() -> None:
    states = [state(1, code="self.sleep(1)"), state(2, "b"), state(3, "c")]
    made = document(
        automaton(1, states, [on("go", 1, 2), after(100, 2, 1), when("False", 1, 3)]),
        properties=[stated("never", "c")],
    )
    report = check_model(made, PATH)
    assert [each.verdict for each in report.properties] == [Verdict.HOLDS]


def test_a_function_of_hand_written_code_may_wait(tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    (tmp_path / "robot_ext.py").write_text(
        "from hfsm_runtime import Component\n\n\nclass RobotExtension(Component):\n"
        "    def nap(self) -> None:\n        self.sleep(1)\n"
    )
    assert slow_code(analyze(timed("self.nap()"), path))
    assert slow_code(analyze(timed("nap = self.nap\nnap()"), path))
    assert slow_code(analyze(timed("me = self\nme.nap()"), path))
    assert slow_code(analyze(timed("self.namespace.nap()"), path))
    assert slow_code(analyze(timed("getattr(self, 'nap')()"), path))
    assert slow_code(analyze(timed("self.rest()", functions="def rest(this):\n    this.nap()"), path))
    assert not slow_code(analyze(timed("self.log.info('x')"), path))


def test_a_function_that_hand_written_code_inherits_may_wait(tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    (tmp_path / "robot_ext.py").write_text(
        "from hfsm_runtime import Component\nfrom naps import Naps\n\n\n"
        "class RobotExtension(Naps, Component):\n    pass\n"
    )
    assert slow_code(analyze(timed("self.nap()"), path))
    assert slow_code(analyze(timed("me = self\nme.nap()"), path))
    assert not slow_code(analyze(timed("self.n = 1\nself.log.info('%d', self.n)\nself.send('x')"), path))
