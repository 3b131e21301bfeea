"""A domain of DDS on loopback, and the thread that takes what programs of a robot's maker send there.

A program is the participant that writes its messages, for as long as it can. DDS reports within a second that
one left, or was killed; of one that hangs, after the time that its participant announced, 10 s or 20 s unless
it was configured.
"""

from __future__ import annotations

import logging
import re
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, Final, NamedTuple, Self

from cyclonedds import builtin
from cyclonedds._clayer import ddspy_take, ddspy_write
from cyclonedds.core import DDSException, InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import make_idl_struct
from cyclonedds.idl.annotations import autoid, final
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from naoserver.errors import RobotError
from naoserver.protocol.jobs import Job, Periodic
from visualhfsm_makers._introduction import Introduction
from zenoh_ice import WallClock
from zenoh_ice.data.text import printable

_logger = logging.getLogger(__name__)

_HIGHEST_DOMAIN: Final = 232
_URL: Final = re.compile(r"dds:(\d{1,3})")
_PERIOD: Final = 0.1
"""Wall seconds after which programs are looked for, and what they command is renewed."""
_AT_ONCE: Final = 20
"""Most messages of a topic that are taken before it is the turn of the others."""
_MOST_LATE: Final = 5
"""Most messages of a topic that are sent together because they are late; longer pauses are left out."""
_END_LIMIT: Final = 5.0
_ANY: Final = SampleState.Any | ViewState.Any | InstanceState.Any
_ROBOTS: Final = "rt/"
"""How topics of robots begin."""
_ROS: Final = ("rt/rosout", "rt/parameter_events")
"""Topics that each node of ROS has, for others like it."""
_MOST_PROGRAMS, _MOST_REPORTED = 64, 16
"""Programs that are known by their unserved topics, and such topics of each; others are not reported."""
_LONGEST_NAME: Final = 100
_HEADER: Final = b"\0\1\0\0"
"""What precedes a message in the plain representation, little endian."""
CALLS: Final = Qos(Policy.History.KeepLast(100))
"""For calls and answers: most that wait."""
NEWEST: Final = Qos(Policy.History.KeepLast(1))
"""For states and commands, each of which replaces the one before."""
_CONFIGURATION: Final = (
    '<CycloneDDS><Domain Id="any"><General><Interfaces><NetworkInterface name="lo"/></Interfaces>'
    "</General><Discovery><SPDPInterval>1 s</SPDPInterval></Discovery>"
    "<Internal><MaxSampleSize>128 kB</MaxSampleSize></Internal></Domain></CycloneDDS>"
)


_Of = Callable[[str], None]
"""Called with the name of a program."""


def message(typename: str, **members: Any) -> Any:  # noqa: ANN401 - cyclonedds has no types
    """Make a type of messages, whose members are on the wire in their order."""
    made = make_idl_struct(typename.rpartition(".")[2], typename, members)
    return final(autoid("sequential")(made))


class Writer:
    """Send the messages of a topic, of any thread."""

    def __init__(self, writer: Any) -> None:  # noqa: ANN401
        self._writer = writer

    @property
    def wanted(self) -> bool:
        """Whether a program reads them."""
        return bool(self._writer.get_matched_subscriptions())

    def send(self, message: Any) -> None:  # noqa: ANN401
        """Send a message, or the bytes of one, which is a tenth of the work: plain CDR, without header.

        One that DDS does not take is reported in the log.
        """
        try:
            if not isinstance(message, bytes):
                self._writer.write(message)
            elif (code := ddspy_write(self._writer._ref, _HEADER + message + bytes(-len(message) % 4))) < 0:
                raise DDSException(code)
        except DDSException as error:
            _logger.warning("a message to programs was lost: %s", error)


class _Input(NamedTuple):
    """A topic that programs write."""

    reader: Any
    kind: Any
    news: Any
    take: Callable[[Any, str], None]
    raw: bool


class Wire:
    """A domain of DDS on loopback alone, dds:DOMAIN, in a `with` block.

    Its thread, called `name`, begins with `start`. It gives each message to its taker with the name that its
    program has in the eyes of the guards, and that name to `heard` before. It calls `renew` every 0.1 s, and
    `drop` with the name of each program that is gone, and of all at the end. Takers raise nothing. Raises
    RobotError for a domain that cannot be joined.
    """

    def __init__(self, url: str, name: str, renew: Callable[[], None], drop: _Of, heard: _Of) -> None:
        found = _URL.fullmatch(url)
        if found is None or int(found[1]) > _HIGHEST_DOMAIN:
            raise RobotError(f"{url[:40]} is no domain of DDS: write dds:0 to dds:{_HIGHEST_DOMAIN}")
        self._url = url
        self._name = name
        self._renew = renew
        self._drop = drop
        self._heard = heard
        self.unserved: Callable[[str, str, int], None] = lambda _topic, _text, _number: None
        """Called once for each topic that a program reads or writes and nobody serves: with it, a text for
        people, and how many of this program came before."""
        self._kinds: dict[str, str] = {}
        """The types of served topics, as DDS spells them."""
        self._reported: dict[bytes, set[str]] = {}
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._inputs: list[_Input] = []
        # Their names in the eyes of the guards, by the handles of writers.
        self._programs: dict[int, str] = {}
        self._due = 0.0
        with self._joining():
            self._domain = Domain(int(found[1]), _CONFIGURATION)
            self._participant = DomainParticipant(int(found[1]))
            self._arrival = WaitSet(self._participant)
            found_by = partial(builtin.BuiltinDataReader, self._participant)
            self._writers = found_by(builtin.BuiltinTopicDcpsPublication)
            self._readers = found_by(builtin.BuiltinTopicDcpsSubscription)
        self._introduction = Introduction(int(found[1]), self._participant.guid.bytes[:12])

    def listen(
        self,
        topic: str,
        kind: type,
        take: Callable[[Any, str], None],
        qos: Any = CALLS,  # noqa: ANN401
        *,
        raw: bool = False,
    ) -> None:
        """Take the messages of a topic; `raw` ones as bytes: plain CDR, little endian, without header."""
        with self._joining():
            reader = DataReader(self._participant, self._topic(topic, kind), qos=qos)
            news = ReadCondition(reader, _ANY)
            self._arrival.attach(news)
        self._inputs.append(_Input(reader, kind, news, take, raw))

    def writer(self, topic: str, kind: type, qos: Any = CALLS) -> Writer:  # noqa: ANN401
        """Return what sends the messages of a topic."""
        with self._joining():
            return Writer(DataWriter(self._participant, self._topic(topic, kind), qos=qos))

    def _topic(self, name: str, kind: Any) -> Any:  # noqa: ANN401
        self._kinds[name] = kind.__idl_typename__.replace(".", "::")
        return Topic(self._participant, name, kind)

    def publish(self, topic: str, kind: type, period: float, message: Callable[[], Any]) -> Job:
        """Return the job that sends a topic every `period` s of wall time while a program reads it."""
        writer, wall, slot = self.writer(topic, kind, NEWEST), WallClock(), 0

        def send() -> None:
            """Send a message, and those for which the thread came too late."""
            nonlocal slot
            last, slot = slot, round(wall.now() / period)
            for _ in range(slot - last if slot - last <= _MOST_LATE else 1):
                writer.send(message())

        thread = f"{self._name} states"
        return Periodic(topic, wall, lambda: period, send, thread=thread, wanted=lambda: writer.wanted)

    def start(self) -> None:
        """Begin to take messages. Raises RobotError if nobody can be found in the domain."""
        self._introduction.start()
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._introduction.close()
        self._ending.set()
        if self._thread.ident is not None:
            self._thread.join(_END_LIMIT)
            if self._thread.is_alive():
                _logger.error("%s did not end within %g s", self._name, _END_LIMIT)
                return
        self._domain._delete(self._domain._ref)  # and all in it, whoever still has a reference

    @contextmanager
    def _joining(self) -> Iterator[None]:
        try:
            yield
        except DDSException as error:
            raise RobotError(
                f"cannot join {self._url} on loopback: {error}; "
                "another domain helps if a program has one of its ports"
            ) from None

    def _run(self) -> None:
        try:
            while not self._ending.is_set():
                try:
                    self._take_turn()
                except (Exception, SystemExit):  # no message, and no driver, ends the service of others
                    _logger.exception("%s goes on after an error", self._name)
                    self._ending.wait(_PERIOD)
        finally:
            for client in set(self._programs.values()):
                self._lose(client)

    def _lose(self, client: str) -> None:
        try:
            self._drop(client)
        except (Exception, SystemExit):  # the others are dropped all the same
            _logger.exception("%s could not end all of a program that is gone", self._name)

    def _take_turn(self) -> None:
        self._arrival.wait(duration(seconds=_PERIOD))
        for topic in self._inputs:
            for message, handle in _taken(topic):
                if handle not in self._programs:
                    self._find_programs()
                if client := self._programs.get(handle):  # otherwise its program is gone
                    self._heard(client)
                    topic.take(message, client)
        if time.monotonic() >= self._due:  # after the messages: if this thread is late, no program is silent
            self._due = time.monotonic() + _PERIOD
            self._find_programs()
            self._renew()
            self._find_unserved()

    def _find_unserved(self) -> None:
        """Report topics of new readers and writers that nobody serves."""
        for reader, does in ((self._writers, "writes"), (self._readers, "reads")):
            try:
                taken = reader.take(_AT_ONCE)
            except Exception as error:  # noqa: BLE001 - as in _taken
                _logger.debug("what a program announced cannot be read: %s", error)
                continue
            for each in taken:
                topic, kind = each.topic_name, each.type_name
                served, gone = self._kinds.get(topic), not each.sample_info.valid_data
                if gone or served == kind or topic in _ROS or not topic.startswith(_ROBOTS):
                    continue
                reported = self._reported.setdefault(each.participant_key.bytes, set())
                if len(self._reported) > _MOST_PROGRAMS:
                    del self._reported[next(iter(self._reported))]
                if topic not in reported and len(reported) < _MOST_REPORTED:
                    name, kind = printable(topic, _LONGEST_NAME), printable(kind, _LONGEST_NAME)
                    how = f"is of type {served}, not {kind}" if served else "is not served"
                    self.unserved(topic, f"{name}, which a program {does}, {how}", len(reported))
                    reported.add(topic)

    def _find_programs(self) -> None:
        """Name new programs, and drop lost ones."""
        # cyclonedds gives handles with a sign here, and without one beside a message.
        present = {
            handle % 2**64: (topic.reader, handle)
            for topic in self._inputs
            for handle in topic.reader.get_matched_publications()
        }
        for handle in self._programs.keys() - present.keys():
            if (client := self._programs.pop(handle)) not in self._programs.values():
                self._lose(client)
        for handle in present.keys() - self._programs.keys():
            reader, own = present[handle]
            if (writer := reader.get_matched_publication_data(own)) is not None:
                self._programs[handle] = f"{self._name} {writer.participant_key.hex}"


def _taken(topic: _Input) -> Iterator[tuple[Any, int]]:
    """Take some messages; yield each with the handle of its writer."""
    if topic.raw:
        taken = ddspy_take(topic.reader._ref, _ANY, _AT_ONCE)
        for data, info in taken if isinstance(taken, list) else ():
            if info.valid_data and data[:2] == _HEADER[:2]:
                yield data[4:], info.publication_handle
        return
    for _ in range(_AT_ONCE):
        try:
            taken = topic.reader.take(1)
        except Exception as error:  # noqa: BLE001 - whatever cyclonedds raises for bytes that it cannot read
            _logger.debug("a message cannot be read: %s", error)
            continue
        if not taken:
            return
        if isinstance(taken[0], topic.kind):
            yield taken[0], taken[0].sample_info.publication_handle
