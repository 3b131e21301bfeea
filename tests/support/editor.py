"""The editor's server on a free port, and windows that communicate with it like a page."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import functools
import http.client
import json
import socket
import threading
import time
from collections.abc import AsyncGenerator, Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from codegen.hfsm.document import Document
from codegen.messages import Message
from tests.support.limits import END_LIMIT, PAGE_LIMIT, START_LIMIT
from tests.support.ports import free_port
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._editor.limits import Limits
from visualhfsm._editor.parts import MakeParts, Parts
from visualhfsm._editor.server import Options, Report, Server
from visualhfsm._monitor.messages import Publish, Stopper
from visualhfsm.project._check_process import CheckProcess
from visualhfsm.project._editing.undo_stack import MERGE_WITHIN

DOCUMENT = """<?xml version="1.0" encoding="UTF-8"?>
<VisualHFSM>
  <SubAutomata id="1" idFather="0">
    <state initial="true" id="1">
      <posx>100</posx>
      <posy>100</posy>
      <name>wait</name>
      <code>pass</code>
    </state>
    <state initial="false" id="2">
      <posx>300</posx>
      <posy>100</posy>
      <name>go</name>
      <code>pass</code>
    </state>
  </SubAutomata>
</VisualHFSM>
"""


class Refused(AssertionError):
    """A request was answered with an error of some `kind`."""

    def __init__(self, answer: dict[str, Any]) -> None:
        super().__init__(answer["error"])
        self.kind: str = answer["kind"]


class NoPart:
    """Replaces a service that a test does not use."""

    def __getattr__(self, name: str) -> Callable[..., Any]:
        async def refuse(*_: object, **__: object) -> None:
            raise VisualHfsmError(Message("{name} is not available", name=name))

        return refuse

    def require_connected(self) -> None:
        """Do nothing: what is started needs no robot."""

    async def camera(self, name: str) -> AsyncGenerator[bytes, None]:
        """Refuse."""
        raise VisualHfsmError(Message("there is no camera {name}", name=name))
        yield

    async def poses(self, language: str) -> AsyncGenerator[bytes, None]:
        """Refuse."""
        raise VisualHfsmError(Message("the poses are not available"))
        yield

    def names(self, *, dry: bool | None = None) -> set[str]:
        """Return nothing: nothing runs."""
        return set()

    def prepare(self) -> None:
        """Do nothing: nothing will start."""

    def announce_stop(self, by: Stopper | None = None) -> None:
        """Do nothing: nothing runs."""

    async def stop_all(self) -> None:
        """Do nothing: nothing runs."""

    async def forget(self, tab: int) -> None:
        """Do nothing: nothing runs."""

    async def refresh(self, *_: object) -> None:
        """Do nothing: there are no tests."""

    async def locate(self, *_: object) -> None:
        """Know of nothing."""

    async def follow(self, component: str, *, awaited: bool = False) -> dict[str, Any]:
        """Know nothing of a component that was just started."""
        if not awaited:
            raise VisualHfsmError(Message("{name} is not available", name=component))
        return {}

    async def unfollow(self, component: str) -> None:
        """Do nothing: nothing is followed."""

    async def close(self) -> None:
        """Do nothing: nothing is open."""


class NoCodeHelp:
    """Replaces the help with code in a test that does not use it."""

    def ask(self, *_: Any, **__: Any) -> object:
        """Refuse."""
        raise VisualHfsmError(Message("help with code is not available"))

    def interfaces(self, _folder: Path) -> object:
        """Refuse."""
        raise VisualHfsmError(Message("help with code is not available"))

    def close(self) -> None:
        """Do nothing: nothing is open."""


def parts(code_help: Any = None, started: Any = None, followers: Any = None, robot: Any = None) -> Parts:
    """Return parts, some of which a test provides."""
    missing: Any = NoPart()
    help_with_code: Any = code_help or NoCodeHelp()
    return Parts(help_with_code, started or missing, followers or missing, robot or missing, missing)


def no_parts(_publish: Publish) -> Parts:
    """Return parts that are not available."""
    return parts()


class Editor:
    """A running server in a separate thread."""

    def __init__(self, options: Options, report: Report) -> None:
        self.server = Server(options, report=report)
        self.port = self.server.port
        self.host = f"127.0.0.1:{self.port}"
        self._started = threading.Event()
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="editor of a test")

    def _run(self) -> None:
        try:
            asyncio.run(self.server.serve(self._started.set))
        except BaseException as error:  # noqa: BLE001 - the test's own thread raises it
            self._failure = error
            self._started.set()
        finally:
            self.server.close()

    def __enter__(self) -> Self:
        self._thread.start()
        assert self._started.wait(START_LIMIT)
        if self._failure is not None:
            self._thread.join(END_LIMIT)
            raise self._failure
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
        if self._failure is not None and error is None:
            raise self._failure

    def stop(self) -> None:
        """Stop the server and wait for its end: until then, it holds the journals of its documents."""
        self.server.stop()
        self._thread.join(END_LIMIT)
        assert not self._thread.is_alive(), "the server does not end"

    def get(
        self, path: str, headers: dict[str, str] | None = None, method: str = "GET"
    ) -> tuple[int, dict[str, str], bytes]:
        """Return status, headers and content of the server's answer; `headers` replace the usual ones."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PAGE_LIMIT)
        with contextlib.closing(connection):
            connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            for name, value in {"Host": self.host, **(headers or {})}.items():
                connection.putheader(name, value)
            connection.endheaders()
            response = connection.getresponse()
            found = {name.lower(): value for name, value in response.getheaders()}
            return response.status, found, response.read()

    def cookie(self) -> str:
        """Log in and return the cookie."""
        status, headers, _ = self.get(f"/?token={self.server.credentials.new_token()}")
        assert status == 303
        return headers["set-cookie"].partition(";")[0]

    @contextlib.contextmanager
    def socket(
        self, path: str = "/ws", headers: dict[str, str] | None = None, origin: str | None = None
    ) -> Iterator[ClientConnection]:
        """Open a websocket as the page does; `headers` replace the usual ones."""
        with connect(
            f"ws://{self.host}{path}",
            origin=Origin(f"http://{self.host}" if origin is None else origin),
            additional_headers={"Cookie": self.cookie()} if headers is None else headers,
            max_size=None,
            close_timeout=PAGE_LIMIT,
            open_timeout=PAGE_LIMIT,
            proxy=None,
        ) as socket:
            yield socket

    def upgrade(self, path: str, headers: dict[str, str]) -> int:
        """Return the status with which the server answers a handshake with these headers and no others."""
        with socket.create_connection(("127.0.0.1", self.port), PAGE_LIMIT) as client:
            client.sendall(_handshake(path, headers))
            return int(client.recv(64).split(b" ")[1])

    @contextlib.contextmanager
    def deaf_window(self) -> Iterator[Callable[[bytes], None]]:
        """Open a window that says hello and reads nothing from then on, and yield a function that sends more."""
        with socket.create_connection(("127.0.0.1", self.port), PAGE_LIMIT) as client:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            client.sendall(
                _handshake(
                    "/ws",
                    {"Host": self.host, "Origin": f"http://{self.host}", "Cookie": self.cookie()},
                )
            )
            assert client.recv(12) == b"HTTP/1.1 101"
            hello = b'{"id": 1, "op": "hello"}'
            client.sendall(b"\x81" + bytes([0x80 | len(hello)]) + bytes(4) + hello)  # masked with zeros
            yield client.sendall

    @contextlib.contextmanager
    def window(self, language: str = "en") -> Iterator[Window]:
        """Open a window that has said hello, in a language."""
        with self.socket() as socket:
            window = Window(socket)
            window.hello = window.ask("hello", language=language)
            yield window

    @contextlib.contextmanager
    def opened(self, *paths: Path) -> Iterator[None]:
        """Open documents; afterwards close all that are open, and end what runs of them."""
        with self.window() as window:  # not open meanwhile, where it would read nothing
            for path in paths:
                window.ask("open", path=str(path))
        yield
        with self.window() as window:
            for tab in [each["tab"] for each in window.workspace["tabs"]]:
                window.ask("close", tab=tab, discard=True)

    def do(self, *commands: dict[str, Any]) -> None:
        """Change the only open document, as another window does."""
        with self.window() as window:
            (tab,) = window.documents
            for command in commands:
                window.ask("do", tab=tab, command=command)


class Window:
    """The page's end of a websocket; it keeps what it receives, like the page."""

    hello: Any = None

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.documents: dict[int, dict[str, Any]] = {}
        self.pushes: list[dict[str, Any]] = []
        self.workspace: dict[str, Any] = {}
        self.answers: dict[int, dict[str, Any]] = {}
        self._next = 0

    def send(self, op: str, **fields: Any) -> int:
        self._next += 1
        self.socket.send(json.dumps({"id": self._next, "op": op, **fields}))
        return self._next

    def ask(self, op: str, **fields: Any) -> Any:
        """Send a request, take in messages, and return the answer; raises Refused."""
        return self.answer(self.send(op, **fields))

    def answer(self, number: int) -> Any:
        """Return the answer of a request, once it is there; raises Refused."""
        while number not in self.answers:
            self.wait_for(lambda message: "re" in message)
        answer = self.answers.pop(number)
        if "error" in answer:
            raise Refused(answer)
        return answer["ok"]

    def wait_for(self, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Take in messages until one is wanted."""
        until = time.monotonic() + PAGE_LIMIT
        while True:
            message: dict[str, Any] = json.loads(self.socket.recv(max(0.0, until - time.monotonic())))
            self._take_in(message)
            if wanted(message):
                return message

    def wait_for_push(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Return such a push: one that was taken in already, or the next that comes."""

        def wanted(message: dict[str, Any]) -> bool:
            return message.get("push") == kind and all(
                message.get(name) == value for name, value in fields.items()
            )

        return next((push for push in self.pushes if wanted(push)), None) or self.wait_for(wanted)

    def _take_in(self, message: dict[str, Any]) -> None:
        kind = message.get("push")
        if kind is None:
            self.answers[message["re"]] = message
            return
        self.pushes.append(message)
        if kind == "workspace":
            self.workspace = message
        elif kind == "closed":
            self.documents.pop(message["tab"], None)
        elif kind == "document":
            self.documents[message["tab"]] = message["full"]


def _handshake(path: str, headers: dict[str, str]) -> bytes:
    fields = {
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
        "Sec-WebSocket-Version": "13",
        **headers,
    }
    lines = [f"GET {path} HTTP/1.1", *(f"{name}: {value}" for name, value in fields.items())]
    return "\r\n".join([*lines, "", ""]).encode()


class SharedChecks(CheckProcess):
    """Checks the documents of one editor after the other."""

    def close(self) -> None:
        """Do nothing: the next editor needs it."""


SHARED_CHECKS: Final[list[SharedChecks]] = []
"""The process that checks for all editors, if there is one."""


@contextlib.contextmanager
def shared_checks() -> Iterator[None]:
    """Check the documents of all editors within the block in one process, which is started now."""
    checks = SharedChecks()
    checks.check(Document(), None)
    SHARED_CHECKS.append(checks)
    try:
        yield
    finally:
        SHARED_CHECKS.remove(checks)
        CheckProcess.close(checks)


USUAL_PORTS: Final = 3


def usual_port() -> int:
    """Return a port of most editors of this process, of which a browser caches the page; 0 if none is free.

    There are several: some tests run an editor beside one that their file shares.
    """
    for number in range(USUAL_PORTS):
        port = chosen_port(number)
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            with contextlib.suppress(OSError):
                probe.bind(("127.0.0.1", port))
                return port
    return 0


@functools.cache
def chosen_port(_number: int) -> int:
    """Return the same port each time that it is asked for the same one."""
    return free_port()


@contextlib.contextmanager
def editor(
    root: Path,
    *files: Path,
    hosts: tuple[str, ...] = (),
    limits: Limits | None = None,
    port: int | None = None,
    make_parts: MakeParts = no_parts,
    demo: bool = False,
    report: Report = lambda *_: None,
    base_path: str = "/",
    trust_proxy: bool = False,
    socket_path: Path | None = None,
    merge_within: float = MERGE_WITHIN,
) -> Iterator[Editor]:
    """Serve the editor in a directory; journals are kept beside that. By default it has the usual port.

    Like changes within `merge_within` s are one step.
    """

    def make(publish: Publish) -> Parts:
        made = make_parts(publish)
        return dataclasses.replace(made, checks=SHARED_CHECKS[-1]) if SHARED_CHECKS else made

    options = Options(
        files=files,
        root=root,
        hosts=hosts,
        base_path=base_path,
        trust_proxy=trust_proxy,
        socket=socket_path,
        port=usual_port() if port is None else port,
        limits=limits
        or Limits(
            quiet_seconds=0.05,
            file_check_seconds=0.2,
            operation_seconds=PAGE_LIMIT,
            merge_seconds=merge_within,
        ),
        make_parts=make,
        journals=root.with_name("journals"),
        demo=demo,
    )
    with Editor(options, report) as running:
        yield running
