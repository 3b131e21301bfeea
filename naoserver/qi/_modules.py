"""What every service of NAOqi has: calls that run in the background as tasks, and a description of itself."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from itertools import count
from typing import Any, Final, NamedTuple

import qi

from naoserver.qi._arguments import chosen, constant, listed, number
from naoserver.qi._clients import Activity, Call, CallTable

VERSION: Final = "2.8.6.23"
"""Version of the emulated NAOqi."""
CHECK_PERIOD: Final = 0.05
"""Robot seconds between two checks of the condition that a call waits for."""


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
