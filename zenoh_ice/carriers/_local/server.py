"""The socket of a process that serves, through which others of its machine and user call it."""

from __future__ import annotations

import hashlib
import logging
import os
import re
import resource
import select
import socket
import tempfile
import threading
import time
from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Final

from zenoh_ice.carriers._local import messages
from zenoh_ice.carriers._local.listeners import Listeners
from zenoh_ice.carriers._local.memory import Arena
from zenoh_ice.data.codec import DECODE_ERRORS, LARGEST_BULK, Pieces
from zenoh_ice.data.exceptions import MarshalException
from zenoh_ice.threads.limits import LIMITS, Limits
from zenoh_ice.threads.pool import Job, JobKind, Pool, Source
from zenoh_ice.transport import Receiver, refusal

_ACCEPT_PERIOD: Final = 0.02  # s between attempts while the process may open no further file
_SAMPLE_LIMIT: Final = 0.005  # s that a sample waits while an answer is sent
_MOST_UNSENT: Final = 2 * LARGEST_BULK  # bytes of these answers
_SHARE_OF_FILES: Final = 0.5  # of what the process may open: others go over the network

_CAPABILITIES: Final = re.compile(r"^Cap(?:Prm|Eff):\s*([0-9a-f]+)$", re.MULTILINE)

_logger = logging.getLogger(__name__)


class LocalServer(Source):
    """Take channels of processes of the same user, and pass their calls to receivers.

    The socket is bound in a folder that only the user may enter, and loses its name at once: it is reached
    through the descriptor that this process keeps, which the system shows to its user alone. So nothing is
    left when the process is killed. Raises OSError where there is no such socket.
    """

    def __init__(
        self, pool: Pool, receivers: Mapping[str, Receiver], server: str, limits: Limits = LIMITS
    ) -> None:
        self.server: Final = server
        self.limits: Final = limits
        self.pool: Final = pool
        self.receivers: Final = receivers
        self.kind: Final = JobKind()
        """Of what every channel does."""
        self._lock: Final = threading.Lock()
        self._channels: Final[set[ServerChannel]] = set()
        self._closed = self._complained = False
        if not (space := local_space()):
            raise OSError("the system shows this process to no other one of its user")
        self._most: Final = int(_SHARE_OF_FILES * resource.getrlimit(resource.RLIMIT_NOFILE)[0])
        self._socket: Final = messages.end_in_children(messages.new_socket)
        try:
            self._handle: Final = _bind(self._socket)
        except OSError:
            self._socket.close()
            raise
        self.address: Final = f"{space}.{os.getpid()}.{self._handle}"
        """Where processes of the same space find it, as the tokens of its servants say."""
        self.streams: Final[dict[str, Listeners]] = {}
        """Listeners to the streams of large values, by the keys of these."""
        self.arena: Arena | None = None
        try:
            self.arena = Arena(limits)
        except OSError as error:
            _logger.warning("no memory to share, large values go through the socket: %s", error)
        self._socket.listen()
        self._socket.setblocking(False)
        pool.attach(self)

    def fileno(self) -> int:
        return self._socket.fileno()

    def next_job(self) -> Job | None:
        try:
            connection = messages.end_in_children(lambda: self._socket.accept()[0])
        except BlockingIOError:
            return None
        except OSError as error:
            if not self._closed:
                if not self._complained:
                    self._complained = True
                    _logger.warning("no further connection from this machine: %s", error)
                time.sleep(_ACCEPT_PERIOD)  # the socket is readable all the time
            return None
        self._complained = False
        return self.kind, partial(self._open, connection)

    def close(self) -> None:
        """End all channels; take no further ones."""
        with self._lock:
            self._closed = True
            channels = list(self._channels)
        self.pool.detach(self)
        self._socket.close()
        os.close(self._handle)
        for each in channels:
            each.close()
        if self.arena is not None:
            self.arena.close()

    def publish(self, key: str) -> Listeners | None:
        """Return who listens to a stream, from now on; None without memory to share."""
        if self.arena is None:
            return None
        return self.streams.setdefault(key, Listeners(self.arena, self.limits))

    def unpublish(self, key: str) -> None:
        """Let nobody listen to a stream any more."""
        listeners = self.streams.pop(key, None)
        if listeners is not None:
            listeners.close()

    def forget(self, channel: ServerChannel) -> None:
        """Let others come in place of a channel that ended."""
        with self._lock:
            self._channels.discard(channel)

    def _open(self, connection: socket.socket) -> None:
        opened = ServerChannel(self, connection)
        try:
            connection.setblocking(True)
            messages.limit_sending(connection, self.limits.sending)
            if messages.owner_of(connection) != os.geteuid():
                raise PermissionError("a process of another user")
            with self._lock:
                if self._closed or len(self._channels) >= self._most:
                    raise ConnectionRefusedError("too many channels")
                self._channels.add(opened)
            memory = [] if self.arena is None else [self.arena.file]
            socket.send_fds(
                connection,
                [messages.encode((messages.HELLO, messages.VERSION, self.server))],
                memory,
                socket.MSG_NOSIGNAL,
            )
            self.pool.attach(opened)
        except OSError as error:
            _logger.info("a connection from this machine was refused: %s", error)
            opened.close()


class ServerChannel(Source):
    """The server's end of a channel: receives its calls, and sends their answers, and samples."""

    def __init__(self, server: LocalServer, connection: socket.socket) -> None:
        self._server: Final = server
        self._socket: Final = connection
        # Both are held while it is closed: nobody uses a file with the same number.
        self._receiving: Final = threading.Lock()
        self._sending: Final = threading.Lock()
        self._parts: Final = messages.Parts()
        self._lent = -1  # the memory of the last answer
        self._unsent: Final[deque[bytes]] = deque()  # one thread waits until its client takes them
        self._unsent_size = 0
        self._closed = False
        self._ends: Final = select.poll()
        self._ends.register(connection, select.POLLRDHUP)

    def fileno(self) -> int:
        return self._socket.fileno()

    def next_job(self) -> Job | None:
        while True:
            try:
                with self._receiving:
                    data = self._socket.recv(messages.LARGEST_MESSAGE, socket.MSG_DONTWAIT)
                    gone = bool(self._ends.poll(0))  # what it sent before may have lain there for long
            except BlockingIOError:
                return None
            except OSError:
                data = b""
            if not data:
                self.close()
                return None
            try:
                message = messages.decode_to_server(data)
                if not isinstance(message, messages.Request):
                    self._note(message)
                    continue
            except (*DECODE_ERRORS, MarshalException) as error:
                _logger.warning("a malformed message from this machine ends its channel: %s", str(error))
                self.close()
                return None
            if self._closed:  # its client is not stopped, but takes no answers
                self.close()
                return None
            payload = self._parts.complete(message.payload) if self._parts else message.payload
            if self._lent >= 0:  # the answer before was read
                self._give_back(self._lent)
            try:
                receiver = self._server.receivers[message.target]
                job = receiver.admit(
                    message.operation,
                    payload,
                    message.attachment or None,
                    self._answer,
                    gone=gone,
                    ended=self._has_ended,
                )
            except BaseException as failure:  # noqa: BLE001 - it is logged, and answered
                job = refusal(failure, f"{message.target}/{message.operation}", self._answer)
            if job is not None:
                return job

    def _note(self, message: messages.Part | messages.Return | messages.Subscribe) -> None:
        """Take a message that is no call; raises MarshalException for parts that are too large."""
        match message:
            case messages.Part():
                self._parts.append(message.payload)
            case messages.Return():
                self._give_back(message.start)
            case messages.Subscribe():
                self._subscribe(message)

    def _has_ended(self) -> bool:
        """Return whether its client has ended it, even if messages that it sent before wait to be read."""
        with self._sending:
            return self._closed or bool(self._ends.poll(0))

    def _subscribe(self, message: messages.Subscribe) -> None:
        listeners = self._server.streams.get(f"{message.target}/{message.operation}")
        if listeners is None or not listeners.add(self):
            self.close()
            return
        with self._sending:
            self._send(messages.encode((messages.SUBSCRIBED,)))
        if self._closed:  # meanwhile, by another thread
            listeners.remove(self)

    def send_sample(self, message: bytes) -> bool:
        """Send a message without waiting; return whether there was room for it."""
        if not self._sending.acquire(timeout=_SAMPLE_LIMIT):
            return False
        try:
            if not self._closed and not self._unsent:
                self._socket.send(message, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
                return True
        except OSError:  # no room, or no client
            pass
        finally:
            self._sending.release()
        return False

    def _give_back(self, start: int) -> None:
        self._lent = -1
        if self._server.arena is not None:
            self._server.arena.give_back(start, self)

    def _answer(self, ok: bool, answer: bytes | Pieces) -> None:
        with self._sending:
            if self._closed:  # nobody would give memory back
                return
            if isinstance(answer, bytes) and len(answer) <= messages.LARGEST_INLINE:
                self._send(messages.encode((messages.RESPONSE, ok, answer)))
                return
            payload, places, extent = messages.lend(answer, self._server.arena, self)
            if extent is not None:
                self._lent = extent.start
            lent = () if extent is None else (places, extent)
            payload = messages.send_parts(self._send, payload)
            self._send(messages.encode((messages.RESPONSE, ok, payload, *lent)))

    def _send(self, message: bytes) -> None:
        """Send a message, or keep it while its client takes none; with the lock."""
        if self._closed:
            return
        try:
            if not self._unsent:
                self._socket.send(message, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
                return
        except BlockingIOError:
            pass
        except OSError as error:
            self._end(error)
            return
        self._unsent.append(message)
        self._unsent_size += len(message)
        if len(self._unsent) == 1:
            self._server.pool.submit(self._send_rest)
        if self._unsent_size > _MOST_UNSENT:
            self._end("its client takes no answers")

    def _send_rest(self) -> None:
        """Wait for a client that took no answers, on a thread that nobody else needs meanwhile."""
        try:
            with self._server.pool.blocked():
                while True:
                    self._socket.send(self._unsent[0], socket.MSG_NOSIGNAL)
                    with self._sending:
                        self._unsent_size -= len(self._unsent.popleft())
                        if not self._unsent:
                            return
        except OSError as error:
            self._end(error)

    def _end(self, reason: object) -> None:
        """Send no more; its client closes it when it has read what was sent to it, and lent.

        If it is stopped, that may take any time. If it calls nevertheless, it is cut off.
        """
        _logger.debug("answers dropped: %s", reason)
        self._closed = True
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)
        self._remove_from_streams()

    def _remove_from_streams(self) -> None:
        for listeners in list(self._server.streams.values()):
            listeners.remove(self)

    def close(self) -> None:
        """End the channel; answers to its calls are dropped from now on."""
        self._server.pool.detach(self)
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)  # ends a wait to send
        with self._receiving, self._sending:
            self._closed = True
            self._socket.close()
        self._remove_from_streams()
        if self._server.arena is not None:
            self._server.arena.forget(self)
        self._server.forget(self)


def _bind(made: socket.socket) -> int:
    """Bind a socket without a name; return a descriptor through which it is reached."""
    try:
        folder = Path(tempfile.mkdtemp(prefix="zenoh_ice-", dir=os.environ.get("XDG_RUNTIME_DIR") or None))
    except OSError:
        folder = Path(tempfile.mkdtemp(prefix="zenoh_ice-"))
    try:
        inside = os.open(folder, os.O_PATH | os.O_CLOEXEC)
        try:
            path = f"/proc/self/fd/{inside}/socket"  # shorter than the folder's own may be
            made.bind(path)
            try:
                return os.open(path, os.O_PATH | os.O_CLOEXEC)
            finally:
                os.unlink("socket", dir_fd=inside)
        finally:
            os.close(inside)
    finally:
        folder.rmdir()


def local_space() -> str:
    """Return the same text in all processes that can reach each other's sockets; empty if none can.

    These are processes of one user and group with the same capabilities, on one machine, and in one container
    if in any: see "Ptrace access mode checking" in ptrace(2).
    """
    own = Path("/proc/self")
    try:
        # A process whose program has capabilities, say, cannot be inspected by others of its user: its files
        # in /proc belong to root.
        if (own / "fd").stat().st_uid != os.geteuid():
            return ""
        machine = Path("/proc/sys/kernel/random/boot_id").read_text("ascii").strip()
        kinds = {"pid", "user"}  # a system may lack one of them
        namespaces = sorted(path.stat().st_ino for path in (own / "ns").iterdir() if path.name in kinds)
        permitted, effective = _CAPABILITIES.findall((own / "status").read_text("utf-8", "replace"))
    except (OSError, ValueError):  # no /proc
        return ""
    if permitted != effective:  # not even another such process
        return ""
    rights = f"{os.geteuid()} {os.getegid()} {permitted}"
    return hashlib.sha256(f"{machine} {namespaces} {rights}".encode()).hexdigest()[:16]
