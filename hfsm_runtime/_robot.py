"""A component's access to the robot as a whole: connect to its servants, and know whether it may command."""

from __future__ import annotations

import difflib
import logging
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Final

from interfaces.nao import SafetyPrx, SafetyState
from zenoh_ice import Communicator, ConnectFailedException, ObjectNotExistException, ObjectPrx, ZenohIceError
from zenoh_ice.application.patience import Patience
from zenoh_ice.data.interface import Interface
from zenoh_ice.data.text import few

from .component import Component, proxies_of
from .errors import ComponentError

ROBOT: Final = "Safety"
"""A servant that every robot has."""
_START_LIMIT: Final = 2.0
"""The longest wait in wall seconds for a robot that is starting."""
_MOST_NAMED: Final = 4
"""Most servants that an error lists when none is named like the one that is missing."""
_LEASE_LIMIT: Final = 1.0
"""Wall seconds for the robot's answer to the question who may command it."""

_logger = logging.getLogger(__name__)


def connect(component: Component, communicator: Communicator, patience: Patience | None = None) -> None:
    """Connect every proxy that a component declares and that is not connected yet.

    Raises ConnectFailedException when there is no server at all, and otherwise ComponentError, which names
    every proxy that has no servant, or one of another interface. A robot that is starting is waited for with
    `patience`; when it is there, it has announced all that it serves.
    """
    patience = patience or Patience(_START_LIMIT)
    problems: list[str] = []
    lacking: dict[str, dict[str, str]] = {}  # by realm: who needs what, and the identity that its robot lacks
    for name, declared in proxies_of(component).items():
        if name in vars(component):
            continue
        untyped = communicator.stringToProxy(declared.identity)
        realm = untyped.ice_getRealm()
        identity = untyped.ice_getIdentity()
        need = f"self.{name} needs {servant_of(identity, declared.type.ice_interface)}"
        if realm in lacking and _robot_lacks(untyped):
            lacking[realm][need] = identity  # the wait for the first one was long enough for all
            continue
        try:
            vars(component)[name] = patience.until_served(
                partial(declared.type.checkedCast, untyped), partial(_has_robot, untyped)
            )
        except ConnectFailedException:
            raise
        except ObjectNotExistException as error:
            if _robot_lacks(untyped):
                lacking.setdefault(realm, {})[need] = identity
                continue
            problems.append(f"self.{name}: {error}")
            if not communicator.identities(realm):
                break  # the realm is empty: waiting for each of the others would show the same
        except ZenohIceError as error:
            problems.append(f"self.{name}: {error}")
    problems += [_lack(needs, communicator.identities(realm)) for realm, needs in lacking.items()]
    if problems:
        raise ComponentError("the component cannot start: " + "; ".join(problems))


def servant_of(identity: str, interface: Interface) -> str:
    """Return how errors name a servant: its identity, and its interface as documents write it."""
    return f"{identity} ({interface.type_id.rpartition('::')[2]})"


def _has_robot(proxy: ObjectPrx) -> bool:
    """Return whether there is a robot in the realm of a proxy."""
    return ROBOT in _served_with(proxy)


def _robot_lacks(proxy: ObjectPrx) -> bool:
    """Return whether there is a robot in the realm of a proxy, but not its servant."""
    served = _served_with(proxy)
    return ROBOT in served and proxy.ice_getIdentity() not in served


def _served_with(proxy: ObjectPrx) -> list[str]:
    """Return what is served in the realm of a proxy, as far as is known without asking."""
    return proxy.ice_getCommunicator().identities(proxy.ice_getRealm())


def _lack(needs: Mapping[str, str], served: Sequence[str]) -> str:
    """Return the problem of proxies that need what a robot lacks; similar names come first."""
    return f"{', '.join(needs)}, which this robot does not serve; it serves {like(needs.values(), served)}"


def like(wanted: Iterable[str], served: Sequence[str]) -> str:
    """Return the servants that are named most like those that are wanted, or else some, and how many more."""
    similar = [name for each in wanted for name in difflib.get_close_matches(each, served, 2)]
    return few(list(dict.fromkeys((*similar, *served))), len(set(similar)) or _MOST_NAMED)


def servers_present(component: Component, communicator: Communicator) -> bool:
    """Return whether every servant of a connected proxy is there, as far as is known without asking."""
    for name in proxies_of(component):
        proxy = vars(component).get(name)
        if isinstance(proxy, ObjectPrx) and proxy.ice_getIdentity() not in communicator.identities(
            proxy.ice_getRealm()
        ):
            return False
    return True


def _safeties_of(component: Component) -> list[SafetyPrx]:
    """Return `Safety` of each robot of another realm whose servants a component has proxies of."""
    found = {}
    for name in proxies_of(component):
        proxy = vars(component).get(name)
        if isinstance(proxy, ObjectPrx):
            communicator, realm = proxy.ice_getCommunicator(), proxy.ice_getRealm()
            if realm != communicator.realm:
                found[realm] = SafetyPrx.uncheckedCast(communicator.stringToProxy(f"{ROBOT}@{realm}"))
    return [*found.values()]


class Permission:
    """Find out from `Safety` whether the robot may be commanded: whether it was stopped, and may go on.

    After an emergency stop a person lets a component go on, or lets the reset do so: the reset alone starts
    nothing (ISO 13850:2015, 4.1.4). That a server knows of no stop is not enough: it may have been started
    since then, and have found no record of the stop.
    """

    def __init__(
        self, safety: SafetyPrx, component: Component | None = None, limit: float = _LEASE_LIMIT
    ) -> None:
        self._safety = safety.ice_invocationTimeout(1000.0 * limit)
        self._component = component
        """Commands robots of other realms, too, perhaps."""
        self._limit = limit
        self._known: tuple[str, int] | None = None
        """The session of the server, and how often it was stopped, when the component was last let go on."""
        self._stopped_by = ""  # the session of the server that was seen stopped
        self._told = ""  # what the log said last of what a person has to do

    def begin_again(self) -> None:
        """Forget the stop that was seen: a person has decided to go on."""
        self._stopped_by = self._told = ""
        others = _safeties_of(self._component) if self._component else []
        for safety in (self._safety, *(each.ice_invocationTimeout(1000.0 * self._limit) for each in others)):
            with suppress(ZenohIceError):  # its next command says why
                safety.resumeCommands()
        with suppress(ZenohIceError):
            state = self._safety.getSafetyState()
            self._known = state.session, state.stops - state.stopped  # one that lasts is not over yet

    def why_stopped(self) -> str:
        """Return why the robot is or was stopped since the component began, or was last let go on.

        Empty if it was not, as far as its stream says: this asks nobody.
        """
        state = self._newest()
        if state is None or not self._was_stopped(state):
            return ""
        self._stopped_by = state.session
        return f"the robot is stopped: {state.reason}" if state.stopped else "the robot was stopped"

    def is_given(self, holder: str) -> bool:
        """Return whether commands may be accepted now; ask as soon as one was refused, and then regularly.

        `holder` held the robot when it refused the command; it is empty if nobody did. If `Safety` cannot be
        reached, or reports no reason for the refusal, only another command can find out.
        """
        try:
            state = self._safety.getSafetyState()
        except ZenohIceError:
            return not self._stopped_by
        self._known = self._known or (state.session, 0)  # a stop before this question may be why
        if self._was_stopped(state):
            self._stopped_by = self._stopped_by or state.session
        if state.stopped:
            self._stopped_by = state.session
            return False
        if self._stopped_by not in {"", state.session} and not state.wasReset:
            self._tell(
                "the robot's server was started again and knows of no emergency stop, but nobody has reset "
                "the one that was seen: reset it (nao stop --reset), or resume by hand"
            )
            return False
        if self._stopped_by and not state.resumes:
            self._tell(
                "the emergency stop was reset: resume by hand, or let all behaviors go on "
                "(nao stop --reset --resume)"
            )
            return False
        self._stopped_by = ""
        self._known = state.session, state.stops
        return not state.holder or state.holder != holder

    def _newest(self) -> SafetyState | None:
        try:
            sample = self._safety.getSafetyState.latest()
        except ZenohIceError:  # of another version: commands will say so
            return None
        return None if sample is None else sample.value

    def _was_stopped(self, state: SafetyState) -> bool:
        """Return whether a stop is not over by what was known when the component was last let go on."""
        session, stops = self._known or (state.session, state.stops)
        self._known = session, stops
        return state.stopped or state.stops > (stops if state.session == session else 0)

    def _tell(self, what: str) -> None:
        if self._told != what:
            self._told = what
            _logger.warning("%s", what)
