"""What a submission could try in order to get marks, or to do harm: none succeeds, and each is named.

Each attack is the code of a state, and its submission is good when the state after it is reached. A witness
outside looks at what the attack was for. Where it does no harm, the same attack runs without walls, and the
witness must see it there: otherwise the test could not fail.

All attacks are in one document, whose parameter says which of them runs. Those that end with an exception run one
after the other in one process, too; `make soak` runs each of them alone.
"""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pytest

from tests.support.documents import document, state, sub, transition
from tests.support.limits import RUN_LIMIT
from tests.support.soak import cases
from tests.support.waiting import until
from visualhfsm.simulation import DocumentInvalid
from visualhfsm.trials import Outcome, Plan, Success, run_trial
from visualhfsm_classes import Allowance, Containment, SandboxUnavailable

BLOCK: Final = 0.3
"""Wall seconds of a piece of code that is to take too long."""
PATIENT_BLOCK: Final = 60.0
"""Wall seconds of others, on a computer with much else to do."""


@dataclass
class Victims:
    """What the attacks are after."""

    folder: Path
    process: subprocess.Popen[bytes]
    tcp: socket.socket
    unix: socket.socket
    abstract: socket.socket

    @property
    def names(self) -> dict[str, object]:
        """What the codes of attacks know: more than a pupil could."""
        return {
            "folder": str(self.folder),
            "judge": os.getpid(),
            "process": self.process.pid,
            "port": self.tcp.getsockname()[1],
            "unix": self.unix.getsockname(),
            "abstract": self.abstract.getsockname().decode(),
        }

    def untouched(self) -> bool:
        """Return whether nothing was changed, connected to or killed."""
        files = {path.name: path.read_text() for path in sorted(self.folder.rglob("*")) if path.is_file()}
        if files != FILES or self.process.poll() is not None:
            return False
        return not any(map(_connected, (self.tcp, self.unix, self.abstract)))


FILES: Final = {
    "solution.xml": "the solution",
    "hidden.trials.toml": "the hidden trials",
    "bob.xml": "the submission of Bob",
    "marks.csv": "ana,0",
}


@contextmanager
def _victims(folder: Path) -> Iterator[Victims]:
    exercise = folder / "exercise"
    exercise.mkdir()
    for name, content in FILES.items():
        (exercise / name).write_text(content)
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    with (
        process,
        socket.create_server(("127.0.0.1", 0)) as tcp,
        socket.socket(socket.AF_UNIX) as unix,
        socket.socket(socket.AF_UNIX) as abstract,
    ):
        unix.bind(str(folder / "door"))
        abstract.bind(f"\0visualhfsm-attack-{os.getpid()}-{unix.fileno()}")
        for listener in (tcp, unix, abstract):
            listener.listen()
            listener.setblocking(False)
        yield Victims(exercise, process, tcp, unix, abstract)
        process.kill()


@pytest.fixture(scope="module")
def victims(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Victims]:
    """What no attack may touch."""
    with _victims(tmp_path_factory.mktemp("victims")) as victims:
        yield victims


def _connected(listener: socket.socket) -> bool:
    try:
        listener.accept()[0].close()
    except BlockingIOError:
        return False
    return True


@dataclass(frozen=True)
class Attack:
    """The code of a state, and what the outcome says of it."""

    code: str
    said: str
    control: bool = True
    """Whether it is tried without walls, too."""
    alone: bool = False
    """Whether its process, or what its exception says, cannot be shared with others."""
    good: bool = True
    """Whether its submission would be good."""


FORGED: Final = 'b"\\x91\\xa4Done"'

ATTACKS: Final = {
    "reads the solution": Attack(
        "open({folder!r} + '/solution.xml').read()", "its code raised FileNotFoundError: ", alone=True
    ),
    "lists the hidden trials": Attack(
        "import os\nos.listdir({folder!r})", "its code raised FileNotFoundError: "
    ),
    "reads another submission": Attack(
        "import pathlib\npathlib.Path({folder!r}, 'bob.xml').read_bytes()", "its code raised FileNotFoundError: "
    ),
    "searches the packages": Attack(
        "import os\nfound = []\nfor folder, _, files in os.walk('/packages'):\n"
        "    for file in files:\n"
        "        path = os.path.join(folder, file)\n"
        "        if '/_shipped/' in path or '/trials/' in path or '/behaviors/' in path or file.endswith('.trials.toml') or (\n"
        "                file.endswith('.xml') and b'<VisualHFSM' in open(path, 'rb').read()):\n"
        "            found.append(path)\n"
        "raise LookupError(f'found {{found}}')",
        "its code raised LookupError: found []",
        control=False,
    ),
    "reads the passwords": Attack("open('/etc/shadow').read()", "its code raised FileNotFoundError: ", control=False),
    "reads the environment of others": Attack("open('/proc/1/environ').read()", "its code raised FileNotFoundError: ", control=False),
    "reads homes": Attack("import os\nos.listdir('/home')", "its code raised FileNotFoundError: "),
    "writes marks": Attack(
        "with open({folder!r} + '/marks.csv', 'w') as marks:\n    marks.write('ana,10')",
        "its code raised FileNotFoundError: ",
    ),
    "writes into the packages": Attack(
        "import hfsm_runtime, pathlib\n(pathlib.Path(hfsm_runtime.__file__).parent / 'mine.py').write_text('')",
        "its code raised OSError: [Errno 30] Read-only file system",
        control=False,
    ),
    "goes out by a link": Attack(
        "import os\nos.symlink({folder!r}, '/tmp/out-' + str(os.getpid()))\n"
        "found = os.listdir('/tmp/out-' + str(os.getpid()))\nos.unlink('/tmp/out-' + str(os.getpid()))",
        "its code raised FileNotFoundError: ",
    ),
    "forges an answer": Attack(
        f"import os, struct\nframe = struct.pack('>I', 7) + {FORGED} + b'\\xc3'\n"
        "frame = struct.pack('>I', len(frame) - 4) + frame[4:]\n"
        "for file in range(3, 64):\n    try:\n        os.write(file, frame)\n    except OSError:\n        pass",
        "its process sent what",
        control=False,
        alone=True,
        good=False,
    ),
    "sends garbage": Attack(
        "import os\nfor file in range(3, 64):\n    try:\n        os.write(file, b'marks: 10' * 100)\n"
        "    except OSError:\n        pass",
        "a message of 1835102827 bytes",
        control=False, alone=True,
    ),
    "sends a huge message": Attack(
        "self.log.warning('x' * 100)\nimport os, struct\nfor file in range(3, 64):\n    try:\n"
        "        os.write(file, struct.pack('>I', 1 << 23) + bytes(1 << 23))\n    except OSError:\n        pass",
        "a message of 8388608 bytes",
        control=False, alone=True,
    ),
    "sends a nested message": Attack(
        "import os, struct\nbody = b'\\x91' * 200_000\nfor file in range(3, 64):\n    try:\n"
        "        os.write(file, struct.pack('>I', len(body)) + body)\n    except OSError:\n        pass",
        "its process sent what is no message",
        control=False, alone=True,
    ),
    "kills the judge": Attack(
        "import os, signal\nos.kill({process}, signal.SIGKILL)", "its code raised ProcessLookupError: "
    ),
    "kills everything": Attack(
        "import os, signal\nos.kill(-1, signal.SIGKILL)\nos.kill(os.getppid(), signal.SIGKILL)",
        "in state attack",
        control=False, alone=True,
    ),
    "starts a process": Attack(
        "import os\nchild = os.fork()\nif not child:\n    os._exit(0)\nos.waitpid(child, 0)",
        "its code raised PermissionError: ",
    ),
    "leaves a daemon behind": Attack(
        "import subprocess, sys\nwrites = 'import sys; open(sys.argv[1], chr(119)).close()'\n"
        "subprocess.Popen([sys.executable, '-c', writes, {folder!r} + '/daemon'], start_new_session=True).wait()",
        "its code raised PermissionError: ",
    ),
    "makes threads without end": Attack(
        "import threading\nend = threading.Event()\nthreading.stack_size(1 << 15)\nwhile True:\n"
        "    threading.Thread(target=end.wait, daemon=True).start()",
        # The kernel refuses them to all but root.
        "started more than 64 threads in state attack" if os.geteuid() == 0 else "its code raised RuntimeError: can't start",
        control=False, alone=True,
    ),
    "takes the disk by its output": Attack(
        "import ctypes\nlibc = ctypes.CDLL(None, use_errno=True)\nfor file in (1, 2):\n"
        "    if not libc.fallocate(file, 1, ctypes.c_long(0), ctypes.c_long(3 << 30)):\n        break\n"
        "else:\n    raise OSError(ctypes.get_errno(), 'fallocate')",
        "its code raised PermissionError: ",
        control=False,
    ),
    "watches the packages": Attack(
        "import ctypes\nlibc = ctypes.CDLL(None, use_errno=True)\nif libc.inotify_init() < 0:\n"
        "    raise OSError(ctypes.get_errno(), 'inotify_init')",
        "its code raised PermissionError: ",
        control=False,
    ),
    "locks the packages": Attack(
        "import fcntl, hfsm_runtime\nfcntl.flock(open(hfsm_runtime.__file__), fcntl.LOCK_EX)",
        "its code raised PermissionError: ",
        control=False,
    ),
    "writes a large file": Attack(
        "with open('/tmp/large', 'wb') as file:\n    for _ in range(100):\n        file.write(bytes(1 << 20))",
        "its code raised OSError: [Errno 27] File too large",
        control=False,
    ),
    "writes many files": Attack(
        "for number in range(100):\n    with open(f'/tmp/{{number}}', 'wb') as file:\n"
        "        file.write(bytes(1 << 20))",
        "its code raised OSError: [Errno 28] No space left on device",
        control=False,
    ),
    "writes to other file systems": Attack(
        "for folder in ('/', '/dev', '/dev/shm', '/packages', '/etc', '/usr', '/var'):\n    try:\n"
        "        open(folder + '/visualhfsm-attack', 'w')\n    except OSError:\n        continue\n"
        "    raise SystemExit('wrote to ' + folder)\nraise OSError('nothing can be written')",
        "its code raised OSError: nothing can be written",
        control=False,
    ),
    "takes memory": Attack("taken = bytearray(1 << 36)", "its code raised MemoryError", control=False),
    "takes memory that is no address space": Attack(
        "import os\nfile = os.memfd_create('memory')\nwhile True:\n    os.write(file, bytes(1 << 20))",
        "its code raised PermissionError: ",
        control=False,
    ),
    "opens a connection": Attack(
        "import socket\nsocket.create_connection(('127.0.0.1', {port}), 1.0)", "its code raised PermissionError: "
    ),
    "opens a Unix socket": Attack(
        "import socket\nsocket.socket(socket.AF_UNIX).connect({unix!r})", "its code raised PermissionError: "
    ),
    "opens an abstract socket": Attack(
        "import socket\nsocket.socket(socket.AF_UNIX).connect({abstract!r})", "its code raised PermissionError: "
    ),
    "sleeps forever": Attack(
        "self.sleep(1e9)", "slept more than 120 s of the trial in state attack", control=False, alone=True
    ),
    "waits forever": Attack(
        "import threading\nthreading.Event().wait()", f"took more than {BLOCK:g} s in state attack", control=False, alone=True
    ),
    "never ends": Attack("while True:\n    pass", f"took more than {BLOCK:g} s in state attack", control=False, alone=True),
    "asks forever": Attack(
        "while True:\n    self.mark('Camera', 1.0, 1.0)",
        f"took more than {BLOCK:g} s in state attack",
        control=False, alone=True,
    ),
    "follows another process": Attack(
        "import ctypes, os\nlibc = ctypes.CDLL(None, use_errno=True)\nif libc.ptrace(16, {process}, 0, 0):\n"
        "    raise OSError(ctypes.get_errno(), 'ptrace')",
        "its code raised PermissionError: ",
        control=False,
    ),
    "becomes root": Attack("import os\nos.setuid(0)", "its code raised OSError: [Errno 22]", control=False),
    "mounts": Attack(
        "import ctypes\nlibc = ctypes.CDLL(None, use_errno=True)\nif libc.unshare(0x10000000):\n"
        "    raise OSError(ctypes.get_errno(), 'unshare')",
        "its code raised PermissionError: ",
        control=False,
    ),
    "ends its process": Attack(
        "import os\nos._exit(0)",
        "its process ended by itself with exit code 0 in state attack",
        control=False, alone=True,
    ),
    "crashes": Attack(
        "import ctypes\nctypes.string_at(0)", "its process was killed by SIGSEGV in state attack", control=False, alone=True
    ),
    "calls itself forever": Attack("self.again()", "its code raised RecursionError: ", control=False),
    "exits": Attack("import sys\nsys.exit('10 points')", "its code raised SystemExit: 10 points", control=False, alone=True),
    "interrupts": Attack("raise KeyboardInterrupt", "its code raised KeyboardInterrupt", control=False, alone=True),
    "prints without end": Attack(
        "for _ in range(100):\n    print('x' * (1 << 20))",
        "printed more than 8 MB in state attack, line ",
        control=False, alone=True,
    ),
    "raises what looks like the judge's": Attack(
        "class BehaviorFailed(Exception):\n    def __str__(self):\n        raise ValueError\nraise BehaviorFailed",
        "its code raised BehaviorFailed: its message is not available",
        control=False, alone=True,
    ),
    "looks for the judge's modules": Attack(
        "import visualhfsm.trials", "its code raised ModuleNotFoundError: No module named 'visualhfsm.trials'",
    ),
}  # fmt: skip


NUMBERS: Final = {name: number for number, name in enumerate(ATTACKS)}
LAST: Final = (
    "writes a large file",
    "writes many files",
    "kills the judge",
)
"""Attacks after which others would meet limits that they are not after."""
MANY: Final = [
    *(name for name, attack in ATTACKS.items() if not attack.alone and name not in LAST),
    *LAST,
]
CONTROLS: Final = [
    *(name for name, attack in ATTACKS.items() if attack.control and name not in LAST),
    "kills the judge",
]
MEETS: Final = """
if self.attack >= 0:
    exec(codes[self.attack], {"self": self})
    done = self.attack not in bad
elif not met:
    for number in [many, controls][self.attack + 2]:
        met[str(number)] = "succeeded"
        try:
            exec(codes[number], {"self": self})
        except BaseException as error:
            met[str(number)] = f"its code raised {type(error).__name__}: {error}"
"""
"""The submission itself says what happened to each."""
MANY_AT_ONCE: Final = -2
CONTROLS_AT_ONCE: Final = -1


def submission(folder: Path, victims: Victims) -> Path:
    variables = {
        "codes": [attack.code.format(**victims.names) for attack in ATTACKS.values()],
        "bad": [NUMBERS[name] for name, attack in ATTACKS.items() if not attack.good],
        "many": [NUMBERS[name] for name in MANY],
        "controls": [NUMBERS[name] for name in CONTROLS],
        "met": {},
        "done": False,
    }
    path = folder / "ana.xml"
    path.write_text(
        document(
            sub(
                1,
                0,
                state(1, "attack", MEETS, initial=True),
                state(2, "good"),
                transition(1, 1, 2, "done"),
                variables="\n".join(f"{name} = {value!r}" for name, value in variables.items()),
                functions="def again(self):\n    self.again()",
            ),
            head="<parameters><parameter><name>attack</name><type>int</type><default>0</default></parameter></parameters>",
        ),
        encoding="utf-8",
    )
    return path


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory, victims: Victims) -> Path:
    """The document with all attacks."""
    return submission(tmp_path_factory.mktemp("attacks"), victims)


@pytest.fixture(scope="module")
def containment() -> Iterator[Containment]:
    """Walls that many tests share; what runs within them may take its time."""
    with Containment(allowance=Allowance(block=PATIENT_BLOCK, begin=PATIENT_BLOCK)) as containment:
        yield containment


@pytest.fixture(scope="module")
def strict() -> Iterator[Containment]:
    """Walls within which no piece of code may take long."""
    with Containment(allowance=Allowance(block=BLOCK, begin=PATIENT_BLOCK)) as containment:
        yield containment


def graded(path: Path, containment: Containment, **parameters: int) -> Outcome:
    plan = Plan(
        document=str(path), robot="none", limit=1.0, success=Success(state="good"), parameters={**parameters}
    )
    return run_trial(plan, 1, simulate=containment.simulate)


def met(path: Path, containment: Containment, which: int) -> Mapping[str, str]:
    """Return what happened to each of many attacks, one after the other."""
    with containment.simulate(path, robot=None, parameters={"attack": which}) as behavior:
        behavior.advance(0.1)
        happened = behavior.variables(1)["met"]
    return {name: happened[str(number)] for name, number in NUMBERS.items() if str(number) in happened}


@pytest.mark.parametrize(
    "name",
    cases(
        [name for name, attack in ATTACKS.items() if attack.alone],
        soak=[name for name, attack in ATTACKS.items() if not attack.alone],
    ),
)
def test_an_attack_fails_and_is_named(
    path: Path, victims: Victims, containment: Containment, strict: Containment, name: str
) -> None:
    attack = ATTACKS[name]
    outcome = graded(path, strict if f"{BLOCK:g} s" in attack.said else containment, attack=NUMBERS[name])
    said = re.sub(r"\[Errno \d+\] ?", "", attack.said)  # which nobody needs to know
    assert (outcome.success, said in outcome.reason) == (False, True), outcome.reason
    assert victims.untouched()


@pytest.fixture(scope="module")
def met_within(path: Path, containment: Containment) -> Mapping[str, str]:
    return met(path, containment, MANY_AT_ONCE)


@pytest.mark.parametrize("name", MANY)
def test_an_attack_among_many_fails(victims: Victims, met_within: Mapping[str, str], name: str) -> None:
    assert met_within[name].startswith(ATTACKS[name].said)
    assert victims.untouched()


@pytest.fixture(scope="module")
def met_without(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, str]:
    folder = tmp_path_factory.mktemp("controls")
    with _victims(folder) as victims, Containment(unsafe=True) as containment:
        happened = met(submission(folder, victims), containment, CONTROLS_AT_ONCE)
        assert not victims.untouched()
    return happened


@pytest.mark.parametrize("name", CONTROLS)
def test_without_walls_the_attack_succeeds(met_without: Mapping[str, str], name: str) -> None:
    assert met_without[name] == "succeeded"


@pytest.mark.soak("test_without_walls_the_attack_succeeds")
@pytest.mark.parametrize("name", CONTROLS)
def test_without_walls_an_attack_alone_succeeds(tmp_path: Path, name: str) -> None:
    with _victims(tmp_path) as victims, Containment(unsafe=True) as containment:
        outcome = graded(submission(tmp_path, victims), containment, attack=NUMBERS[name])
        assert outcome.success or not victims.untouched()


JUDGES: Final = {
    "changes the clock": (
        "import hfsm_runtime.virtual.clock as clock\nclock.TaskTimeline.now = lambda self: 10**15"
    ),
    "changes the time": "import time, builtins\ntime.time = time.monotonic = lambda: 1e6",
    "patches the automata": (
        "import hfsm_runtime._actor as run\nrun.Actor.active_time = lambda self, now: 10**12"
    ),
    "patches its transitions": (
        "import hfsm_runtime._cycle as cycle\ncycle._holds = lambda *arguments: True"
    ),
    "looks for the judge's objects": (
        "import gc\nfor each in gc.get_objects():\n"
        "    if type(each).__name__ == '_Observed':\n        each.reached = 0.1"
    ),
    "walks up the stack": (
        "import greenlet\nbelow = greenlet.getcurrent().parent\nwhile below:\n    frame = below.gr_frame\n"
        "    while frame:\n        if type(frame.f_locals.get('self')).__name__ == '_Trial':\n"
        "            frame.f_locals['self']._observed.reached = 0.1\n        frame = frame.f_back\n"
        "    below = below.parent"
    ),
}
"""Codes that change what judges, where they reach it: their submission is good 30 s later only."""

TOGETHER: Final = {**JUDGES, "all of these": "\n".join(JUDGES.values())}

PLAIN: Final = """
import os, sys
from visualhfsm.trials import Plan, Success, run_trial

def good(path):
    plan = Plan(document=path, robot="none", limit=1.0, success=Success(state="good"))
    return run_trial(plan, 1).success

assert not good(sys.argv[1])
for path in sys.argv[2:]:
    child = os.fork()
    if not child:
        os._exit(0 if good(path) else 3)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
"""The first document is not good; each other one runs in a separate process."""


def patient(folder: Path, code: str) -> Path:
    path = folder / "ana.xml"
    attack, good = state(1, "attack", code, initial=True), state(2, "good")
    path.write_text(document(sub(1, 0, attack, good, transition(1, 1, 2, "30000", type="time"))), "utf-8")
    return path


@pytest.mark.parametrize("name", cases(["all of these"], soak=[*JUDGES]))
def test_what_judges_is_out_of_reach(tmp_path: Path, containment: Containment, name: str) -> None:
    outcome = graded(patient(tmp_path, TOGETHER[name]), containment)
    assert (outcome.success, outcome.reason, outcome.time) == (False, "not in good after 1 s", 1.0)


REACHED: Final = [name for name in JUDGES if name != "changes the time"]


@pytest.fixture(scope="module")
def reached(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, str]:
    """What the processes of documents end with that change what judges them, or the error that stopped all."""
    paths = [
        str(patient(tmp_path_factory.mktemp("plain"), code))
        for code in ("pass", *(JUDGES[name] for name in REACHED))
    ]
    command = [sys.executable, "-c", PLAIN, *paths]
    done = subprocess.run(command, timeout=RUN_LIMIT, check=True, capture_output=True, text=True)
    return dict(zip(REACHED, done.stdout.split(), strict=True))


@pytest.mark.parametrize("name", REACHED)
def test_in_one_process_it_is_within_reach(reached: Mapping[str, str], name: str) -> None:
    assert reached[name] == "0"


def out_of_reach(call: str, library: str, identity: str, interface: str) -> str:
    """Return a document that calls a servant."""
    return document(
        sub(
            1,
            0,
            state(1, "attack", f"{call}\ndone = True", initial=True),
            state(2, "good"),
            transition(1, 1, 2, "done"),
            variables="done = False",
        ),
        libraries=(library,),
        config=f"<iceinterface><nameinterface>It</nameinterface><nameproxy>{identity}</nameproxy>"
        f"<interface>{interface}</interface></iceinterface>",
    )


@pytest.mark.parametrize(
    ("call", "library", "identity", "interface"),
    [
        (
            "self.It.setPose3DMotorsData(Pose3DMotorsData())",
            "from interfaces.jderobot import Pose3DMotorsData",
            "BallGreenMotors",
            "Pose3DMotors",
        ),
        ("self.It.inject('HeadYaw', 'stuck')", "math", "Faults", "Faults"),
    ],
    ids=["the ball", "failures"],
)
def test_what_is_for_judges_is_out_of_reach(
    tmp_path: Path, containment: Containment, call: str, library: str, *, identity: str, interface: str
) -> None:
    path = tmp_path / "ana.xml"
    path.write_text(out_of_reach(call, library, identity, interface), encoding="utf-8")
    plan = Plan(document=str(path), robot="fake", limit=1.0, success=Success(state="good", upright=False))
    assert run_trial(plan, 1).success
    outcome = run_trial(plan, 1, simulate=containment.simulate)
    assert not outcome.success
    assert f"a submission cannot reach {identity}: it is for who judges" in outcome.reason


ANSWERS_WITH_ERRORS: Final = document(
    sub(
        1,
        0,
        state(
            1,
            "attack",
            "if heard is None:\n"
            "    import zenoh_ice, visualhfsm_classes.contained._link as transport\n"
            "    heard = self.Head.getPose.subscribe(lambda pose: None)\n"
            "    def fails(inlet, sample):\n"
            "        raise (zenoh_ice.TimeoutException('late'), zenoh_ice.InterfaceMismatchException('x', 'y', 'z'),\n"
            "               SystemExit())[self.error]\n"
            "    transport.FarInlet.push = fails",
            initial=True,
        ),
        state(2, "good"),
        transition(1, 1, 2, "500", type="time"),
        variables="heard = None",
    ),
    config="<iceinterface><nameinterface>Head</nameinterface><nameproxy>Head</nameproxy>"
    "<interface>PoseHead</interface></iceinterface>",
    head="<parameters><parameter><name>error</name><type>int</type><default>0</default></parameter></parameters>",
)


@pytest.mark.parametrize(
    "error", range(3), ids=["TimeoutException", "InterfaceMismatchException", "SystemExit"]
)
def test_errors_between_cycles_end_no_judge(tmp_path: Path, containment: Containment, error: int) -> None:
    path = tmp_path / "ana.xml"
    path.write_text(ANSWERS_WITH_ERRORS, encoding="utf-8")
    plan = Plan(
        document=str(path), robot="fake", limit=1.0, success=Success(state="good", upright=False),
        parameters={"error": error},
    )  # fmt: skip
    assert run_trial(plan, 1, simulate=containment.simulate).reason == ""


@pytest.mark.parametrize("file", ["bob.xml", "../submissions/bob.xml", "{folder}/bob.xml"])
def test_a_submission_imports_no_other_one(tmp_path: Path, containment: Containment, file: str) -> None:
    folder = tmp_path / "submissions"
    folder.mkdir()
    (folder / "bob.xml").write_text(document(sub(1, 0, state(1, "bobs", initial=True))), "utf-8")
    path = folder / "ana.xml"
    owner = state(1, "ana", initial=True, child=2)
    imported = f'<SubAutomata id="2" idFather="1"><import>{file.format(folder=folder)}</import></SubAutomata>'
    path.write_text(document(sub(1, 0, owner), imported), "utf-8")
    with pytest.raises(DocumentInvalid, match=r"ana\.xml cannot be read"):
        graded(path, containment)


def test_a_link_beside_a_submission_leads_nowhere(tmp_path: Path) -> None:
    folder = tmp_path / "ana"
    folder.mkdir()
    (tmp_path / "solution.xml").write_text(document(sub(1, 0, state(1, "solves", initial=True))), "utf-8")
    (folder / "own.xml").symlink_to(tmp_path / "solution.xml")
    path = folder / "ana.xml"
    imported = '<SubAutomata id="2" idFather="1"><import>own.xml</import></SubAutomata>'
    path.write_text(document(sub(1, 0, state(1, "ana", initial=True, child=2)), imported), "utf-8")
    with (
        Containment(files=[folder / "own.xml"]) as containment,
        pytest.raises(DocumentInvalid, match=r"ana\.xml cannot be read"),
    ):
        graded(path, containment)


def test_a_pipe_is_no_submission(tmp_path: Path, containment: Containment) -> None:
    os.mkfifo(tmp_path / "ana.xml")
    with pytest.raises(DocumentInvalid, match=r"ana\.xml is no file"):
        graded(tmp_path / "ana.xml", containment)


def test_a_document_that_would_keep_the_judge_busy_is_refused(
    tmp_path: Path, containment: Containment
) -> None:
    path = tmp_path / "ana.xml"
    path.write_text(document(sub(1, 0, state(1, "fast", initial=True), period="0.1")), "utf-8")
    with pytest.raises(DocumentInvalid, match="more than 5000 cycles in a second"):
        graded(path, containment)


def test_what_a_submission_began_ends_with_the_judge(tmp_path: Path) -> None:
    path = tmp_path / "ana.xml"
    path.write_text(
        document(sub(1, 0, state(1, "waits", "input_of_nobody = ''\nwhile True:\n    pass", initial=True))),
        "utf-8",
    )
    command = [sys.executable, "-c", JUDGE, str(path)]
    environment = {**os.environ, "TMPDIR": str(tmp_path)}  # a killed judge leaves a folder behind
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as judge:
        assert judge.stdout is not None
        sandbox = int(judge.stdout.readline())
        judge.kill()
    until(lambda: not _runs(sandbox))


JUDGE: Final = """
import sys
from visualhfsm_classes import Containment
with Containment() as containment:
    behavior = containment.simulate(sys.argv[1])
    print(behavior._code._sandbox._process.pid, flush=True)
    behavior.advance(1.0)
"""


def _runs(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


MEASURE: Final = """
import contextlib, resource, sys
from hfsm_runtime.virtual import BehaviorFailed
from visualhfsm_classes import Containment
with Containment() as containment, contextlib.suppress(BehaviorFailed):
    containment.simulate(sys.argv[1], robot=None).advance(1.0)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024)
"""


def test_values_that_nobody_asked_for_take_no_memory_of_the_judge(tmp_path: Path) -> None:
    forged = (
        "import os, struct\nbody = b'\\x93\\xa4Done\\xc3\\x81\\xa1a\\xdd' + struct.pack('>I', 3 << 20) + bytes([128]) * (3 << 20)\n"
        "for file in range(3, 64):\n    try:\n        os.write(file, struct.pack('>I', len(body)) + body)\n"
        "    except OSError:\n        pass"
    )  # fmt: skip
    taken = []
    for name, code in ("ana", "pass"), ("bob", forged):
        path = tmp_path / f"{name}.xml"
        path.write_text(document(sub(1, 0, state(1, "attack", code, initial=True))), "utf-8")
        command = [sys.executable, "-c", MEASURE, str(path)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=RUN_LIMIT, check=True)
        taken.append(int(done.stdout))
    assert taken[1] < taken[0] + 64  # MB; decoded, the values of each cycle take 200


def test_what_is_hidden_may_be_within_what_is_hidden(tmp_path: Path) -> None:
    path = tmp_path / "ana.xml"
    code = (
        "import os\nplace = '/packages/include0'\n"
        "self.found = sorted(os.listdir(place)) + os.listdir(place + '/outer')"
    )
    found = transition(1, 1, 2, "self.found == ['outer', 'shown']")
    root = sub(
        1, 0, state(1, "looks", code, initial=True), state(2, "good"), found, variables="self.found = []"
    )
    path.write_text(document(root), "utf-8")
    include = tmp_path / "include"
    hidden = [include.joinpath("outer", *"abcdefg"[:depth]) for depth in range(8)]
    hidden[-1].mkdir(parents=True)
    (include / "shown").mkdir()
    with Containment(include=[include], hidden=hidden) as containment:
        assert graded(path, containment).success


def test_without_bubblewrap_nothing_is_graded(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(SandboxUnavailable, match="apt-get install bubblewrap"):
        Containment()
    Containment(unsafe=True)
