"""A component's access to the robot as a whole: connect to its servants, and stop it."""

from __future__ import annotations

import logging
from concurrent.futures import Future, wait
from typing import Any, Final

from interfaces.nao import SafetyPrx
from zenoh_ice import Communicator, ConnectFailedException, ObjectNotExistException, ObjectPrx, ZenohIceError

from .component import Component, proxies_of, ros_of
from .errors import ComponentError

_STOP_LIMIT: Final = 1.0
"""The longest wait in wall seconds for the robot's answer to being stopped."""
_LEASE_LIMIT: Final = 1.0
"""Wall seconds for the robot's answer to the question who may command it."""

_logger = logging.getLogger(__name__)


def connect(component: Component, communicator: Communicator) -> None:
    """Connect every proxy that a component declares and that is not connected yet.

    Raises ConnectFailedException when there is no server at all, and otherwise ComponentError, which names
    every proxy that has no servant, or one of another interface.
    """
    problems: list[str] = []
    for name, declared in proxies_of(component).items():
        if name in vars(component):
            continue
        try:
            untyped = communicator.stringToProxy(declared.identity)
            proxy = declared.type.checkedCast(untyped)
        except ConnectFailedException:
            raise
        except ObjectNotExistException as error:
            problems.append(f"self.{name}: {error}")
            if not communicator.identities(untyped.ice_getRealm()):
                break  # the realm is empty: waiting for each of the others would show the same
        except ZenohIceError as error:
            problems.append(f"self.{name}: {error}")
        else:
            vars(component)[name] = proxy
    if problems:
        raise ComponentError("the component cannot start: " + "; ".join(problems))


def servers_present(component: Component, communicator: Communicator) -> bool:
    """Return whether every servant of a connected proxy is there, as far as is known without asking."""
    for name in proxies_of(component):
        proxy = vars(component).get(name)
        if isinstance(proxy, ObjectPrx) and proxy.ice_getIdentity() not in communicator.identities(
            proxy.ice_getRealm()
        ):
            return False
    return True


class Permission:
    """Find out from `Safety` whether the robot accepts commands again after it refused one.

    An emergency stop that was seen is over only when somebody has reset it. That a server knows of no stop is
    not enough: it may have been started since then, and have found no record of the stop.
    """

    def __init__(self, safety: SafetyPrx) -> None:
        self._safety = safety.ice_invocationTimeout(1000.0 * _LEASE_LIMIT)
        self._stopped_by = ""  # the session of the server that was seen stopped
        self._doubted = ""  # the session of the server that knows of no stop

    def forget(self) -> None:
        """Forget the stop that was seen: a person has decided to go on."""
        self._stopped_by = ""

    def is_given(self, holder: str) -> bool:
        """Return whether commands may be accepted now; ask as soon as one was refused, and then regularly.

        `holder` held the robot when it refused the command; it is empty if nobody did. If `Safety` cannot be
        reached, or reports no reason for the refusal, only another command can find out.
        """
        try:
            state = self._safety.getSafetyState()
        except ZenohIceError:
            return not self._stopped_by
        if state.stopped:
            self._stopped_by = state.session
            return False
        if self._stopped_by not in {"", state.session} and not state.wasReset:
            if self._doubted != state.session:
                self._doubted = state.session
                _logger.warning(
                    "the robot's server was started again and knows of no emergency stop, but nobody has "
                    "reset the one that was seen: reset it (nao stop --reset), or resume by hand"
                )
            return False
        self._stopped_by = ""
        return not state.holder or state.holder != holder


def stop_robot(component: Component) -> None:
    """Stop everything that a component may have commanded: call the operations that the IDL marks as stops.

    Over ROS, publish the messages that stop, and cancel goals. This takes at most 1.5 s; missing answers are
    logged.
    """
    calls: dict[Future[Any], str] = {}
    for name in proxies_of(component):
        proxy = vars(component).get(name)
        if not isinstance(proxy, ObjectPrx):
            continue
        for operation in proxy.ice_interface.stop_operations:
            try:
                # Every parameter of a stop operation is optional.
                arguments = [None] * len(operation.arguments.fields)
                calls[getattr(proxy, operation.method).begin(*arguments)] = name
            except ZenohIceError as error:
                _logger.warning("self.%s could not be stopped: %s", name, error)
    if ros_of(component):
        from ._ros import stop_ends  # only components that use ROS need its libraries

        stop_ends(component)
    done, late = wait(calls, _STOP_LIMIT)
    for call in done:
        failure = call.exception()
        if failure is not None:
            _logger.warning("self.%s could not be stopped: %s", calls[call], failure)
    for name in sorted({calls[call] for call in late}):
        _logger.warning("self.%s did not say within %g s that it has stopped", name, _STOP_LIMIT)
