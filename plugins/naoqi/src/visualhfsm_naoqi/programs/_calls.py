"""Calls of libqi to the services: one wrapper for errors and long calls.

It handles these pitfalls of libqi in Python: a blocking method occupies one of its few threads, so long
calls return a future and run in a pool; an exception exposes the path and line of the code, so errors are
failed futures, which expose only their text; every method of a registered object can be called, so a bare
facade with only the operations is registered, those of the service and those that every service has.
"""

from __future__ import annotations

import inspect
import logging
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from itertools import count
from typing import Any, Final, NamedTuple

import qi

from naoserver.errors import CommandRefused, InvalidCommand, RobotError
from visualhfsm_naoqi.programs._arguments import chosen, constant, listed, number
from visualhfsm_naoqi.programs._clients import (
    CHECK_PERIOD,
    MOST_WAITING,
    MOST_WAITING_URGENT,
    Activity,
    Call,
    CallTable,
    Client,
    QiLimits,
    running,
)
from zenoh_ice.data.text import encodable, text_of

VERSION: Final = "2.8.6.23"
"""Version of the emulated NAOqi."""


class Operation(NamedTuple):
    """An operation of a service, as clients call it."""

    name: str
    """With its service: `ALMotion::setAngles`."""
    method: Callable[..., Any]
    signature: inspect.Signature
    """The parameters of the client."""
    long: bool
    """Whether a `call` precedes them."""
    urgent: bool
    activities: frozenset[Activity]
    description: str


def operation_of(name: str, method: Callable[..., Any]) -> Operation:
    """Return the operation that a method of a service performs."""
    signature = inspect.signature(method)
    parameters = list(signature.parameters.values())
    long = "call" in signature.parameters
    return Operation(
        name,
        method,
        signature.replace(parameters=parameters[long:]),
        long,
        getattr(method, "urgent", False),
        getattr(method, "begins", frozenset()),
        inspect.getdoc(method) or "",
    )


class Module:
    """The common operations of all services."""

    def __init__(
        self,
        name: str,
        description: str,
        operations: Mapping[str, Operation],
        invoke: Callable[..., object],
        calls: CallTable,
    ) -> None:
        """Describe the service `name`, whose `operations`, these included, may be added later."""
        self._name = name
        self._description = description
        self._operations = operations
        self._invoke = invoke
        self._calls = calls
        self._numbers = count(1)
        self._tasks: dict[float, Any] = {}  # futures of those that may be running

    # -- tasks -------------------------------------------------------------------------------------------

    def pCall(self, call_: object) -> int:
        """Start a call, a list of the operation's name and its arguments; return the number of its task."""
        method, *arguments = listed(call_, "call") or [""]
        operation = self._operation(method)
        for task in [task for task, future in self._tasks.copy().items() if future.isFinished()]:
            self._tasks.pop(task, None)
        future = self._invoke(operation, self._calls.current.client, *arguments, awaited=False)
        task = next(self._numbers)
        if isinstance(future, qi.Future):
            self._tasks[task] = future
        return task

    def isRunning(self, task: object) -> bool:
        """Return whether a task is running."""
        future = self._tasks.get(number(task, "task"))
        return future is not None and not future.isFinished()

    def wait(self, call: Call, task: object, timeout: object) -> bool:
        """Wait until a task has ended, or for some ms; 0 for no limit. Return whether it still runs."""
        clock, limit = self._calls.clock, number(timeout, "timeout") / 1000 or math.inf
        end = clock.now() + limit
        while (running := self.isRunning(task)) and clock.now() < end and not call.wait(CHECK_PERIOD):
            pass
        return running

    def stop(self, task: object) -> None:
        """Cancel a task."""
        if (future := self._tasks.get(number(task, "task"))) is not None:
            future.cancel()

    # -- reflection --------------------------------------------------------------------------------------

    ping = constant("Return True.", True)
    version = constant("Return the version of NAOqi.", VERSION)
    getBrokerName = constant("Return the name of the broker of all services.", "naoqi")

    def getMethodList(self) -> list[str]:
        """Return the names of the operations."""
        return sorted(self._operations)

    def getMethodHelp(self, methodName: object) -> list[object]:
        """Return name and description of an operation, and a list of its parameters: a name and a text."""
        operation = self._operation(methodName)
        parameters = [[parameter, ""] for parameter in _parameters(operation)]
        return [methodName, operation.description, parameters]

    def getModuleHelp(self) -> list[str]:
        """Return name and description of the service."""
        return [self._name, self._description]

    def getUsage(self, name: object) -> str:
        """Return how an operation is called, as text."""
        operation = self._operation(name)
        return f"{name}({', '.join(_parameters(operation))}): {operation.description}"

    def _operation(self, name: object) -> Operation:
        return self._operations[chosen(name, "operation", self._operations)]


def _parameters(operation: Operation) -> list[str]:
    """Return the names of an operation's parameters; `...` stands for any number of further ones."""
    return [
        "..." if parameter.kind is parameter.VAR_POSITIONAL else name.strip("_")
        for name, parameter in operation.signature.parameters.items()
    ]


_logger = logging.getLogger(__name__)


class Calls:
    """Run the operations of services for libqi.

    Short operations run in the thread of libqi that received the call, so a stop waits for nobody. Long ones
    run in the threads of their client.
    """

    def __init__(self, calls: CallTable, limits: QiLimits | None = None) -> None:
        self._end_limit = (limits or QiLimits()).end
        self._calls = calls

    def facade(self, name: str, parts: Sequence[object]) -> Callable[[Client], object]:
        """Return the factory of a client's object with only the public methods of some parts, as `name`."""
        operations: dict[str, Operation] = {}
        description = (inspect.getdoc(type(parts[0])) or "").partition("\n\n")[0]
        module = Module(name, description, operations, self.invoke, self._calls)
        for each in (module, *parts):  # the service's own win
            for method in dir(type(each)):
                if not method.startswith("_") and inspect.isfunction(getattr(type(each), method)):
                    operations[method] = operation_of(f"{name}::{method}", getattr(each, method))
        methods = {method: self._described(operation) for method, operation in operations.items()}
        made = qi.multiThreaded()(type(name, (), methods))

        def make(client: Client) -> object:
            facade = made()
            facade._client = client
            result: object = facade
            return result

        return make

    def close(self) -> None:
        """Stop the running calls, begin no others, and wait, with a limit, for their end."""
        if not self._calls.close(self._end_limit):
            _logger.error("calls of programs did not end within %g s", self._end_limit)

    def invoke(
        self, operation: Operation, client: Client, *arguments: object, awaited: bool = True
    ) -> object:
        """Perform an operation for a client; return its result, or the future of a long or failed one."""
        name = operation.name
        try:
            operation.signature.bind(*arguments)
        except TypeError as error:
            return failed(f"{name}: {error}")
        long = operation.long
        call = Call(self._calls.clock, client, operation.activities, arguments, awaited=long and awaited)

        def work() -> object:
            with running(call):
                return operation.method(*([call] if long else []), *arguments)

        if long:
            return self._begin(name, call, work, urgent=operation.urgent)
        try:
            return self._do(call, work)
        except BaseException as error:  # noqa: BLE001 - whatever it is, the client hears of it
            return failed(_reported(name, error))

    def _described(self, operation: Operation) -> Callable[..., Any]:
        """Return the method of a facade with what libqi wants to know about it."""

        def called(facade: Any, *arguments: object) -> object:  # noqa: ANN401 - its class is made here
            return self.invoke(operation, facade._client, *arguments)

        parameters = operation.signature.parameters.values()
        plain = all(p.kind is p.POSITIONAL_OR_KEYWORD and p.default is p.empty for p in parameters)
        called.__qi_signature__ = f"({'m' * len(parameters)})" if plain else "m"  # type: ignore[attr-defined]
        result = getattr(operation.method, "__qi_return_signature__", None)
        called.__qi_return_signature__ = result  # type: ignore[attr-defined]
        called.__qi_name__ = None  # type: ignore[attr-defined]
        called.__doc__ = operation.description or None
        return called

    def _do(self, call: Call, work: Callable[[], object]) -> object:
        """Do the work of a short call, registered if it begins something."""
        if not call.activities:
            return work()
        self._calls.add(call, math.inf)
        try:
            return work()
        finally:
            self._calls.remove(call)

    def _begin(self, name: str, call: Call, work: Callable[[], object], *, urgent: bool) -> object:
        """Do the work of a long call in a thread of its client; return the future of its result."""
        promise = qi.Promise(lambda _promise: call.stop())

        def result() -> object:
            if not call.stopped.is_set():
                return work()
            if call.refusal:
                raise CommandRefused(call.refusal)
            return None

        def settle() -> None:
            try:
                promise.setValue(result())
            except BaseException as error:  # noqa: BLE001 - even of a driver that calls `sys.exit`
                promise.setError(_reported(name, error))

        def ended(done: Future[None]) -> None:
            self._calls.remove(call)
            if done.cancelled():  # stopped before a thread took it
                settle()

        threads = call.client.urgent_threads if urgent else call.client.threads
        try:
            self._calls.add(call, MOST_WAITING_URGENT if urgent else MOST_WAITING)
            call.work = threads.submit(settle)
        except InvalidCommand as error:
            return failed(f"{name}: {error}")
        except RuntimeError as error:  # the program is gone, or no thread can start
            call.stop()
            self._calls.remove(call)
            return failed(f"{name}: {error}")
        call.work.add_done_callback(ended)
        if call.stopped.is_set():  # meanwhile
            call.stop()
        return promise.future()


def _reported(name: str, error: BaseException) -> str:
    if isinstance(error, RobotError):
        return f"{name}: {error}"
    _logger.error("%s failed", name, exc_info=error)
    return f"{name}: {type(error).__name__}: {encodable(text_of(error))}"


def failed(message: str) -> qi.Future:
    """Return the future of a call that failed."""
    promise = qi.Promise()
    promise.setError(message)
    return promise.future()
