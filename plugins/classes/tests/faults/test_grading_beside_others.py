"""Attacks that are graded beside an honest submission, as a class is: `visualhfsm grade` in a process of its own.

The honest one keeps its marks. Each attack has no points, and a reason that says what it did, in words of the
document. The program that grades stays small, and nothing is left: no file, no process.

`test_grading_attacks.py` has what reaches for files, processes and the judge; these want time, memory, or confusion.
"""

from __future__ import annotations

import os
import re
import subprocess
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import psutil
import pytest

from plugins.classes.tests.support.marks import marks_in
from tests.support.documents import document, state, sub, transition
from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT
from tests.support.processes import module
from tests.support.soak import SOAKS, cases

pytestmark = pytest.mark.slow

EXERCISE: Final = """
title = { en = "Get there" }

[[criteria]]
asks = { en = "It goes to `there`" }
points = 1
state = "there"
"""
MOST_MEMORY: Final = 350
"""MB of a process that grades, which takes 110 for an honest document."""
WORKER: Final = "visualhfsm_classes._worker"


class Attack(NamedTuple):
    """A document, and what is said of it."""

    text: str
    said: str
    beside: Mapping[str, str] = {}
    """Documents in the same folder."""


def code(text: str, said: str, **options: str) -> Attack:
    """Return a document whose first state runs code in each cycle, and never leaves it."""
    first = state(1, "attack", text, initial=True)
    automaton = sub(1, 0, first, state(2, "there"), transition(1, 1, 2, "False"), **options)
    return Attack(document(automaton), said)


def guard(condition: str, said: str) -> Attack:
    first = state(1, "attack", "pass", initial=True)
    return Attack(document(sub(1, 0, first, state(2, "there"), transition(1, 1, 2, condition))), said)


STATE: Final = '<state initial="true" id="1"><name>attack</name></state>'


def xml(content: str = STATE, head: str = "", before: str = "") -> str:
    """Return a document with an automaton."""
    return f'{before}<VisualHFSM>{head}<SubAutomata id="1" idFather="0">{content}</SubAutomata></VisualHFSM>'


def imports(name: str, ids: tuple[int, ...]) -> str:
    """Return a document that imports another one several times."""
    states = "".join(
        f'<state id="{i}"><name>s{i}</name><idSubautomataSon>{i}</idSubautomataSon></state>' for i in ids
    )
    automata = "".join(
        f'<SubAutomata id="{i}" idFather="1"><import>{name}</import></SubAutomata>' for i in ids
    )
    states = states.replace("<state ", '<state initial="true" ', 1)
    return f'<VisualHFSM><SubAutomata id="1" idFather="0">{states}</SubAutomata>{automata}</VisualHFSM>'


LINK: Final = """
import gc, msgspec
from visualhfsm_classes.contained import _protocol as protocol
pipe = next(each for each in gc.get_objects() if type(each).__name__ == "Pipe")
decode = msgspec.msgpack.Decoder(protocol.ToFar).decode
def ask(message):
    pipe.send(msgspec.msgpack.encode(message))
    return decode(pipe.receive()[4:])
"""
"""Asks the judge for anything, past all that checks it behind the walls."""
CALLS: Final = """
import ctypes, os, resource
libc = ctypes.CDLL(None, use_errno=True)
met = []
def call(name, *numbers):
    which = numbers[0] if os.uname().machine == "x86_64" else numbers[1]
    done = libc.syscall(ctypes.c_long(which), *numbers[2:])
    met.append(f"{name} {os.strerror(ctypes.get_errno()) if done < 0 else 'succeeded'}")
call("socketpair", 53, 199, 1, 1, 0, (ctypes.c_int * 2)())
call("ioprio", 251, 30, 1, 0, 1 << 13)
call("mlockall", 151, 230, 3)
call("personality", 135, 92, 0x40000)
call("perf", 298, 241, ctypes.create_string_buffer(128), 0, -1, -1, 0)
for name, change in {
    "nice": lambda: os.nice(-20),
    "realtime": lambda: os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1)),
    "memory": lambda: resource.setrlimit(resource.RLIMIT_AS, (1 << 40, 1 << 40)),
    "cores": lambda: resource.setrlimit(resource.RLIMIT_CORE, (1 << 30, 1 << 30)),
    "hostname": lambda: __import__("socket").sethostname("mine"),
    "clock": lambda: __import__("time").clock_settime(0, 0.0),
}.items():
    try:
        change()
        met.append(f"{name} succeeded")
    except (OSError, ValueError) as error:
        met.append(f"{name} {error.strerror if isinstance(error, OSError) else error}")
raise LookupError(", ".join(met))
"""
SENDS: Final = """
for name, data in {"text": b'"\\xff"', "number": b"1e999", "deep": b"[" * 3000, "large": b"[" + b"[]," * 99_999 + b"[]]"}.items():
    answer = ask(protocol.Send(name, data))
    met.append(f"{name}: {getattr(answer, 'text', 'sent')[:70]}")
raise LookupError("; ".join(met))
"""
AMPLIFIES: Final = """
if not hasattr(protocol, "count"):
    protocol.count, sends = 0, protocol.Pipe.send
    def send(self, data):
        if b"Done" in bytes(data[:12]):
            protocol.count += 1
            data = (b"\\x93\\xa4Done\\xc2\\x81\\xa6v%05d\\xdd" % protocol.count) + (250_000).to_bytes(4, "big") + bytes([128]) * 250_000
        sends(self, data)
    protocol.Pipe.send = send
"""
"""Each answer has a new variable of 250,000 empty dictionaries."""
FILES: Final = "import os, threading\nfor file in range(3, 64):\n    try:\n        {does}\n    except OSError:\n        pass\n"

ATTACKS: Final = {
    # what found something
    "variables of gigabytes": code(LINK + AMPLIFIES, "sent more than 64 MB to the robot, or never goes", period="2"),
    "events of anything": code(
        LINK + "met = []" + SENDS,
        "text: the data of an event is no JSON",
    ),
    "a rate of nothing": code(
        LINK + "met = [ask(protocol.Subscribe(1, 'nao', 'Head', 'getPose', 1)), ask(protocol.Push(1, 5e-324))]\nraise LookupError(met[1].text)",
        "a rate of 5e-324; it may be 0.001 to 1000, in state attack, line",
    ),
    "variables that fail": code("pass", "its code raised ZeroDivisionError: division by zero, in its variables, line 7", variables="x = 1 / 0"),
    "variables that end it": code("pass", "its process ended by itself with exit code 3 in its variables", variables="import os\nos._exit(3)"),
    "calls of the system": code(
        CALLS,
        "socketpair Operation not permitted, ioprio Operation not permitted, mlockall Cannot allocate memory, "
        "personality Operation not permitted, perf Operation not permitted, nice Operation not permitted, "
        "realtime Operation not permitted, memory not allowed to raise maximum limit, "
        "cores not allowed to raise maximum limit, hostname Operation not permitted, clock Operation not permitted",
    ),
    "words of the system": code("open('/nothing')", "its code raised FileNotFoundError: No such file or directory: '/nothing', in state attack, line"),
    # one of each kind
    "closes all descriptors": code("import os\nos.closerange(0, 64)", "its process ended by itself with exit code 0 in state attack"),
    "an error of nonsense": code(
        "raise type('x' * 9999, (Exception,), {'__str__': lambda self: '\\ud800\\u202e\\x1b[2J<script>' * 99})", "its code raised xxxx"
    ),
    "an entity bomb": Attack(
        xml(before="<!DOCTYPE x [<!ENTITY a 'aaaaaaaaaa'>" + "".join(f"<!ENTITY a{i} '{f'&a{i - 1 if i else str()};' * 10}'>" for i in range(10)) + "]>"),
        "document types and entities are not allowed in a document",
    ),
    # others, of processes
    "a half answer": code(FILES.format(does="os.write(file, bytes(2))") + "threading.Event().wait()", "took more than 5 s in state attack"),
    "two answers": code(FILES.format(does="os.write(file, bytes([0, 0, 0, 7, 146, 164]) + b'Done' + bytes([195]))"), "its process sent what"),
    "a message that never ends": code("class E(Exception):\n    def __str__(self):\n        while True:\n            pass\nraise E", "took more than 5 s in state attack"),
    "a message of 100 MB": code("raise ValueError('x' * 100_000_000)", "its code raised ValueError: xxxx"),
    "a chain of errors": code("e = None\nfor i in range(200_000):\n    n = ValueError(str(i))\n    n.__context__ = e\n    e = n\nraise e", "its code raised ValueError: 199999, in state attack, line"),
    "a group of errors": code("raise ExceptionGroup('many', [ValueError(i) for i in range(9)])", "its code raised ExceptionGroup: many (9 sub-exceptions), in state attack, line"),
    "an error that is no Exception": code("class E(BaseException):\n    pass\nraise E('x')", "its code raised E: x, in state attack, line"),
    "stops itself": code("import os, signal\nos.kill(os.getpid(), signal.SIGSTOP)", "took more than 5 s in state attack"),
    "ignores signals": code("import signal\nfor each in signal.valid_signals():\n    try:\n        signal.signal(each, signal.SIG_IGN)\n    except (OSError, ValueError):\n        pass\nwhile True:\n    pass", "took more than 5 s in state attack"),
    "an alarm": code("import signal\nsignal.setitimer(signal.ITIMER_REAL, 0.05)\nwhile True:\n    pass", "its process was killed by SIGALRM in state attack"),
    "an illegal instruction": code("import os, signal\nos.kill(os.getpid(), signal.SIGILL)", "its process was killed by SIGILL"),
    "kills its group": code("import os, signal\nos.killpg(0, signal.SIGTERM)", "its process was killed by SIGTERM in state attack"),
    "folders without end": code("import os\nfor i in range(10**7):\n    os.mkdir(f'/tmp/{i}')", "in state attack"),
    "full pipes": code("import os\nwhile True:\n    reads, writes = os.pipe()\n    os.set_blocking(writes, False)\n    os.write(writes, bytes(1 << 20))", "its code raised OSError: Too many open files, in state attack, line"),
    "a large number": code("10 ** 10 ** 9", "took more than 5 s in state attack"),
    "a text of a large number": code("int('9' * 10**7)", "its code raised ValueError: Exceeds the limit"),
    "a regular expression": code("import re\nre.match('(a+)+$', 'a' * 50 + 'b')", "took more than 5 s in state attack"),
    "a trace function": code("import sys\ndef trace(*_):\n    while True:\n        pass\nsys.settrace(trace)", "took more than 5 s in state attack"),
    "other builtins": code("import builtins\nbuiltins.isinstance = lambda *_: True\nbuiltins.str = None", "its process ended by itself with exit code 1 in transition 1"),
    "another program": code("import os, sys\nos.execv(sys.executable, [sys.executable, '-S', '-c', 'while True: pass'])", "took more than 5 s in state attack"),
    "another program with large arguments": code("import os, sys\nos.execve(sys.executable, ['x' * 999_999], {})", "its code raised OSError: Argument list too long"),
    "sleeps for no number": code(LINK + "ask(protocol.Sleep(float('nan')))", "asked to sleep nan s in state attack"),
    "waits for no number": code(LINK + "ask(protocol.Subscribe(1, 'nao', 'Head', 'getPose', 1))\nask(protocol.Wait(1, float('inf')))", "slept more than 120 s of the trial in state attack"),
    "a program at its end": code("import atexit, os\natexit.register(os.fork)\nclass E:\n    def __del__(self):\n        while True:\n            pass\nself.e = E()\nself.e = None", "took more than 5 s in state attack"),
    "a guard that fails": guard("type('x', (), {'__bool__': lambda self: 1 / 0})()", "its code raised ZeroDivisionError: division by zero, in transition 1, line"),
    "a guard that takes long": guard("sum(range(10**12)) > 0", "took more than 5 s in transition 1"),
    "variables that never end": code("pass", "took more than 30 s in its variables", variables="while True:\n    pass"),
    # others, of documents
    "an external entity": Attack(xml(before="<!DOCTYPE x [<!ENTITY a SYSTEM 'file:///etc/passwd'>]>"), "document types and entities are not allowed"),
    "30,000 states": Attack(xml(STATE + "".join(f'<state id="{i}"><name>s{i}</name></state>' for i in range(2, 30_000))), "never goes to `there`"),
    "14,000 transitions": Attack(xml(STATE + "".join(f'<transition id="{i}"><origin>1</origin><destiny>1</destiny><trans type="time">1</trans></transition>' for i in range(1, 14_000))), "never goes to `there`"),
    "imports that double": Attack(imports("a0.xml", (2, 3)), "more than 10000 automata in total", {f"a{i}.xml": imports(f"a{i + 1}.xml", (2, 3)) for i in range(30)} | {"a30.xml": xml()}),
    "imports itself": Attack(imports("get_there.xml", (2,)), "the files import one another"),
    "a long number": Attack(xml(STATE + f"<iteration_time>{'9' * 10**6}</iteration_time>"), "must be a positive number of milliseconds"),
    "a small number": Attack(xml(STATE + "<iteration_time>1e-9999999</iteration_time>"), "must be a positive number of milliseconds"),
    "a long id": Attack(xml(STATE.replace('id="1"', f'id="{"1" * 10**6}"')), "must be a number from 0 to 2147483647"),
    "an Arabic id": Attack(xml(STATE.replace('id="1"', 'id="\u0661"')), "must be a number from 0 to 2147483647"),
    "a long name": Attack(xml(STATE.replace("attack", "a" * 10**6)), "has a name of more than 200 characters"),
    "deep code": Attack(xml(STATE.replace("</state>", f"<code>{'(' * 10**6}</code></state>")), "too many nested parentheses"),
    "a long sum": Attack(xml(STATE.replace("</state>", f"<code>x = {'1 + ' * 300_000}1</code></state>")), "the code is nested too deeply"),
    "a deep parameter": Attack(xml(head=f"<parameters><parameter><name>a</name><type>int</type><default>{'(' * 10**5}1</default></parameter></parameters>"), "is not a Python literal"),
    "an unknown encoding": Attack(xml(before='<?xml version="1.0" encoding="zlib_codec"?>'), "unreadable XML"),
    "100,000 attributes": Attack("<VisualHFSM " + " ".join(f'a{i}=""' for i in range(10**5)) + "/>", "there is no automaton"),
    "deep elements": Attack("<VisualHFSM>" + "<a>" * 500_000, "elements nested deeper than 64"),
    "many errors": Attack(xml("".join(f'<transition id="{i}"><origin>9</origin><destiny>8</destiny></transition>' for i in range(9999))), "has no state"),
}  # fmt: skip
ORDINARY: Final = list(ATTACKS)[:10]
OTHERS: Final = list(ATTACKS)[10:]


@dataclass(frozen=True)
class Class:
    """The marks of a class with attackers."""

    folder: Path
    rows: Mapping[str, Mapping[str, str]]
    memory: int
    """The most MB that a process that grades has taken."""
    left: list[str]
    """What is left in the folder for temporary files."""
    processes: list[int]
    """Processes of the command that still run."""


@pytest.fixture(scope="module")
def marked(tmp_path_factory: pytest.TempPathFactory) -> Class:
    folder = tmp_path_factory.mktemp("class")
    exercise, handed_in, temporary = folder / "get_there", folder / "handed-in", folder / "temporary"
    for each in (exercise, handed_in, temporary):
        each.mkdir()
    (exercise / "exercise.toml").write_text(EXERCISE, "utf-8")
    (exercise / "task.en.md").write_text("Go.\n", "utf-8")
    (exercise / "trials.toml").write_text('robot = "fake"\nruns = 1\nlimit = 0.5\n', "utf-8")
    honest = sub(
        1, 0, state(1, "here", initial=True), state(2, "there"), transition(1, 1, 2, "100", type="time")
    )
    (handed_in / "ana.xml").write_text(document(honest), "utf-8")
    for name in ATTACKS if SOAKS else ORDINARY:
        attack = ATTACKS[name]
        (handed_in / name).mkdir()
        (handed_in / name / "get_there.xml").write_text(attack.text, "utf-8")
        for beside, content in attack.beside.items():
            (handed_in / name / beside).write_text(content, "utf-8")
    (handed_in / "zoe.xml").write_text(document(honest), "utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(temporary)}
    command = module("visualhfsm", "grade", "get_there", "handed-in", "--workers", "2")
    with subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.DEVNULL) as grading:
        watched, memory = _watch(grading)
        assert grading.returncode == 0
    rows = marks_in(folder / "marks")
    alive = [each.pid for each in watched if each.is_running() and each.status() != psutil.STATUS_ZOMBIE]
    return Class(folder, rows, memory, [path.name for path in temporary.iterdir()], alive)


def _watch(grading: subprocess.Popen[bytes]) -> tuple[set[psutil.Process], int]:
    """Return all processes that a command starts until it ends, and the most MB that one that grades takes."""
    command, found, most = psutil.Process(grading.pid), set[psutil.Process](), 0
    until = time.monotonic() + RUN_LIMIT * (30 if SOAKS else 1)
    while grading.poll() is None:
        assert time.monotonic() < until
        try:
            found |= {*command.children(recursive=True)}
            graders = [each for each in command.children() if WORKER in each.cmdline()]
            most = max([most, *(_peak(each.pid) for each in graders)])
        except (psutil.NoSuchProcess, OSError):
            continue
        time.sleep(0.05)
    return found, most


def _peak(process: int) -> int:
    """Return the most MB that a process has taken so far."""
    found = re.search(r"VmHWM:\s+(\d+) kB", Path(f"/proc/{process}/status").read_text())
    return int(found[1]) >> 10 if found else 0


OURS: Final = re.compile(r"\b_\w+\.py\b|\[Errno|/tmp/|" + re.escape(str(ROOT)))
"""What no reason has: our modules, numbers of errors, and folders of the teacher."""


@pytest.mark.parametrize("name", cases(ORDINARY, soak=OTHERS))
def test_an_attack_has_no_points_and_a_reason_in_words(marked: Class, name: str) -> None:
    row = marked.rows[name]
    said = ATTACKS[name].said.split(", or ")
    assert (row["points"], any(each in row["reasons"] for each in said)) == ("0", True), row["reasons"]
    assert row["reasons"].isprintable()
    assert OURS.search(row["reasons"]) is None, row["reasons"]


def test_the_honest_keep_their_marks(marked: Class) -> None:
    assert [(marked.rows[name]["points"], marked.rows[name]["reasons"]) for name in ("ana", "zoe")] == [
        ("1", "everything as asked")
    ] * 2


def test_nothing_lasting_is_taken(marked: Class) -> None:
    assert marked.memory < MOST_MEMORY
    assert (marked.left, marked.processes) == ([], [])
    pages = [*(marked.folder / "marks").iterdir()]
    assert len(pages) == 2 * len(marked.rows) + 3  # of each a page and its text, and what was written last
    assert all("<script>\ud800" not in page.read_text("utf-8") for page in pages)
