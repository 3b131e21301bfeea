"""What a submission's code may ask for while it runs, done with the real robot in virtual time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any, Final, cast

import msgspec

from hfsm_runtime.errors import ComponentError, ComponentStoppedError, CycleCutError, EventError
from visualhfsm.simulation import Behavior
from visualhfsm_classes._sandbox import ContainedError
from visualhfsm_classes.contained import _protocol as protocol
from visualhfsm_classes.contained._protocol import Answered, Deliver, Done, Failed, Message, Sample
from zenoh_ice import ObjectNotExistException, ObjectPrx, UserException, ZenohIceError
from zenoh_ice.data import typed
from zenoh_ice.data.codec import Parted
from zenoh_ice.data.exceptions import MarshalException, SystemException
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.data.wire import encode_error
from zenoh_ice.objects.proxy import Call
from zenoh_ice.transport import Arrived, Inlet, Outcome

Ask = Callable[[Message, type[Any], str], Any]

_JUDGES: Final = frozenset({"Scene", "GroundTruth", "Faults"})
"""Servants that only judges may use: they say where things are, put them elsewhere, let the robot fail."""
_MOST_STREAMS: Final = 100
_LONGEST_QUEUE: Final = 100
_SLOWEST_RATE: Final = 1e-3
_FASTEST_RATE: Final = 1000.0
"""Samples in a second of a subscription."""
_LARGEST_EVENT: Final = 1 << 16
"""Bytes of an event's data, each of which costs the judge time and memory."""
_LOUDEST: Final = 50
"""The highest level of logging."""


class Requests:
    """Serve the requests of a submission's code; `ask` asks it something in return.

    `behavior` is there before its code is.
    """

    def __init__(self, behavior: Behavior, ask: Ask) -> None:
        self._behavior: Final = behavior
        self._ask: Final = ask
        self._inlets: Final[dict[int, Inlet]] = {}
        self._calls: Final[dict[tuple[str, str], Call[Any, Any]]] = {}

    @property
    def now(self) -> int:
        """The time of the clock in ns."""
        return round(self._behavior.world.clock.now() * 1e9)

    def serve(self, message: Any) -> Message:  # noqa: ANN401 - each kind of message
        """Do what is asked for, and return the answer."""
        value: object = None
        try:
            match message:
                case protocol.Call():
                    value = self._call(message)
                case protocol.Poll():
                    value = self._poll(message)
                case protocol.Sleep():
                    behavior = self._behavior
                    sleep = behavior.component._hfsm_sleep if message.ends else behavior.clock.sleep
                    sleep(message.seconds)
                case protocol.Wait():
                    value = self._wait(message)
                case protocol.Find():
                    value = self._find(message)
                case protocol.Subscribe():
                    self._subscribe(message)
                case protocol.Push():
                    self._push(message)
                case protocol.Unsubscribe():
                    if (inlet := self._inlets.pop(message.stream, None)) is not None:
                        inlet.close()
                case protocol.Send():
                    self._behavior.send_by_code(message.name, _event_data(message.data))
                case protocol.SetMark():
                    self._behavior.component.mark(message.camera, message.u, message.v, message.label)
                case protocol.Log():
                    level = max(0, min(message.level, _LOUDEST))
                    self._behavior.component._hfsm_log.log(level, "%s", message.text)
                case _:
                    raise MarshalException(f"{type(message).__name__} is no request")
        except (CycleCutError, ComponentStoppedError) as error:
            return Failed(self.now, type(error).__name__, "")
        except (ComponentError, SystemException, msgspec.MsgspecError, RecursionError) as error:
            return Failed(self.now, type(error).__name__, str(error))
        return Answered(self.now, value)

    def close(self) -> None:
        """Listen to no stream any more."""
        for inlet in self._inlets.values():
            inlet.close()
        self._inlets.clear()

    def _call(self, message: protocol.Call) -> Outcome:
        key = message.identity, message.operation
        call = self._calls.get(key)
        if call is None:
            proxy, operation = self._found(message.realm, *key)
            call = self._calls[key] = Call(proxy, operation)
        try:
            return True, _plain(call.call_encoded(message.payload))
        except UserException as error:
            return False, encode_error(error)

    def _find(self, message: protocol.Find) -> Mapping[str, str]:
        self._servant(message.realm, message.identity)
        communicator = self._behavior.world.communicator
        return communicator.find(Target(message.realm, message.identity), message.type_id, 0.0)

    def _subscribe(self, message: protocol.Subscribe) -> None:
        if message.stream in self._inlets or len(self._inlets) >= _MOST_STREAMS:
            raise MarshalException(f"at most {_MOST_STREAMS} streams, each with its number")
        _, operation = self._found(message.realm, message.identity, message.operation)
        if not operation.streamed:
            raise MarshalException(f"{operation.name} has no stream")
        queue = max(1, min(message.queue, _LONGEST_QUEUE))
        transport = self._behavior.world.communicator.transport
        target = Target(message.realm, message.identity)
        self._inlets[message.stream] = transport.subscribe(target, operation, queue)

    def _poll(self, message: protocol.Poll) -> Sample | None:
        inlet = self._inlet(message.stream)
        arrived = inlet.poll()
        return None if arrived is None else _opened(inlet.open(arrived))

    def _wait(self, message: protocol.Wait) -> bool:
        self._inlet(message.stream)
        asks = protocol.AskHolds

        def holds() -> bool:
            done: Done = self._ask(asks(self.now, message.stream), Done, "code that waits for a sample")
            return done.value

        return self._behavior.world.clock.wait_for(holds, message.timeout)

    def _push(self, message: protocol.Push) -> None:
        inlet, rate = self._inlet(message.stream), message.rate
        if rate is not None and not _SLOWEST_RATE <= rate <= _FASTEST_RATE:
            raise MarshalException(f"a rate of {rate}; it may be {_SLOWEST_RATE:g} to {_FASTEST_RATE:g}")
        inlet.deliver(partial(self._deliver, message.stream, inlet), rate)

    def _deliver(self, stream: int, inlet: Inlet, arrived: Any) -> None:  # noqa: ANN401 - of the transport
        sample = _opened(inlet.open(arrived))
        # This comes while time passes, perhaps between two cycles: an error must not end what moves the time.
        with suppress(ContainedError, ZenohIceError, ComponentStoppedError):
            self._ask(Deliver(self.now, stream, sample), Done, "the function of a subscription")

    def _inlet(self, number: int) -> Inlet:
        if number not in self._inlets:
            raise MarshalException(f"there is no stream {number}")
        return self._inlets[number]

    def _found(self, realm: str, identity: str, name: str) -> tuple[ObjectPrx, Operation[..., Any]]:
        """Return a proxy with an operation. Raises SystemException."""
        interface = self._servant(realm, identity).ice_interface
        operation = interface.all_operations.get(name) or ObjectPrx.ice_interface.all_operations.get(name)
        if operation is None:
            raise MarshalException(f"{identity} has no operation {name}")
        typed = cast("type[ObjectPrx]", type("ContainedPrx", (ObjectPrx,), {"ice_interface": interface}))
        return typed.uncheckedCast(self._behavior.world.communicator.stringToProxy(identity)), operation

    def _servant(self, realm: str, identity: str) -> Any:  # noqa: ANN401 - a servant
        world = self._behavior.world
        if realm != world.communicator.realm:
            raise ObjectNotExistException(f"there is no realm {realm} in a trial")
        if identity in _JUDGES or identity in self._mechanisms():
            raise ObjectNotExistException(f"a submission cannot reach {identity}: it is for who judges")
        servant = world.network.servant(identity)
        if servant is None:
            raise ObjectNotExistException(f"there is no servant {identity} in this trial")
        return servant

    def _mechanisms(self) -> set[str]:
        """Return the identities of what moves balls."""
        if not self._behavior.has_robot:
            return set()
        names = [each.name for each in self._behavior.robot.device.mechanisms]
        return {f"{name}{part}" for name in names for part in ("Motors", "Encoders")}


def _event_data(encoded: bytes) -> Any:  # noqa: ANN401 - whatever JSON knows
    """Return the data of an event. Raises EventError."""
    if len(encoded) > _LARGEST_EVENT:
        raise EventError(
            f"an event has at most {_LARGEST_EVENT >> 10} kB of data, not {len(encoded) >> 10} kB"
        )
    try:
        return typed.from_json(encoded) if encoded else None
    except (msgspec.MsgspecError, ValueError) as error:
        raise EventError(f"the data of an event is no JSON: {error}") from error


def _opened(arrived: Arrived) -> Sample:
    assert arrived.attachment is not None
    return Sample(_plain(arrived.payload), arrived.attachment)


def _plain(payload: bytes | Parted) -> bytes | Parted:
    return payload if isinstance(payload, Parted) else bytes(payload)
