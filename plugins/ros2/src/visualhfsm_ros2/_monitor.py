"""Show a component in the graph of ROS 2, and let ROS steer it through the operations of its monitor."""

from __future__ import annotations

import functools
import logging
import re
import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from typing import Any, Final, Self

import msgspec

from hfsm_runtime import Automaton, Transition
from hfsm_runtime.component import name_of, parameter_values, parameters_of
from hfsm_runtime.debugger.monitor import Monitor
from hfsm_runtime.errors import ComponentError
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor, ChangeKind
from interfaces import hfsm
from zenoh_ice.data.text import sentence
from zenoh_ros2 import InvalidNameError, Node, Parameters, QoS, RosError, RosoutHandler, Service

_STATUS: Final = "smach_msgs/msg/SmachContainerStatus"
_STRUCTURE: Final = "smach_msgs/msg/SmachContainerStructure"
_TRANSITION: Final = "lifecycle_msgs/msg/TransitionEvent"
_TRIGGER: Final = "std_srvs/srv/Trigger"
_NO_DATA: Final = b"\x80\x02}."
"""An empty dict, pickled: viewers of SMACH unpickle the data of each status."""
_HEARTBEAT: Final = 1.0
"""Wall seconds after which everything is published again, as SMACH's viewers expect."""
_GATHERING: Final = 0.02
"""Wall seconds in which changes are gathered."""
_MOST_TRANSITIONS: Final = 1000  # that wait to be published
_CLOSE_LIMIT: Final = 2.0  # s
_LARGEST_ID: Final = 255  # of lifecycle_msgs

_logger = logging.getLogger(__name__)


class RosMonitor(Observer):
    """Show a component as a node of ROS during a `with` block.

    Its topics are `~/smach/container_structure` and `~/smach/container_status`, with one message for each
    automaton, and `~/transitions`. Its services are `~/pause`, `~/resume`, `~/step`, `~/reload`, `~/stop`,
    and `~/event/NAME` for each event that the automata wait for. The component's parameters are those of the
    node, and its logs go to /rosout.
    """

    def __init__(self, monitor: Monitor, node: Node) -> None:
        self._monitor: Final = monitor
        self._runtime: Final = monitor.runtime
        self._node: Final = node
        self._generation = -1
        self._paths: dict[int, str] = {}
        self._events: dict[tuple[str, str], Service] = {}
        """The services that send events, by the names of event and service."""
        self._parameters: dict[str, object] = {}
        """The parameters that the node has, by name."""
        self._dirty: set[int] = set()
        self._fired: Final[deque[tuple[int, Actor, Transition]]] = deque(maxlen=_MOST_TRANSITIONS)
        self._wake: Final = threading.Event()
        self._closing = False
        self._thread: Final = threading.Thread(target=self._publish, name="ROS monitor", daemon=True)

    def __enter__(self) -> Self:
        """Announce everything. Raises RosError."""
        node = self._node
        depth = min(len(self._runtime.tree.actors), 10_000)  # late subscribers get one of each automaton
        latched = QoS(durability="transient_local", depth=depth)
        self._structure = node.create_publisher(_STRUCTURE, "~/smach/container_structure", latched)
        self._status = node.create_publisher(_STATUS, "~/smach/container_status", latched)
        self._transitions = node.create_publisher(_TRANSITION, "~/transitions", QoS(depth=100))
        self._node_parameters = Parameters(node)
        servant = self._monitor.servant
        for name, act in (
            ("pause", servant.pause),
            ("resume", servant.resume),
            ("step", self._step),
            ("reload", self._reload),
            ("stop", servant.stop),
        ):
            node.create_service(_TRIGGER, f"~/{name}", self._handler(act))
        self._handler_of_logs = RosoutHandler(node)
        self._logs = tuple(map(logging.getLogger, (name_of(self._runtime.component), "hfsm_runtime")))
        for log in self._logs:
            log.addHandler(self._handler_of_logs)
        self._runtime.tree.observers.append(self)
        self._renew()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Publish the last states; the node's end withdraws the rest."""
        self._closing = True
        self._wake.set()
        self._thread.join(_CLOSE_LIMIT)
        for log in self._logs:
            log.removeHandler(self._handler_of_logs)
        self._handler_of_logs.close()

    # Notifications from the automata

    def changed(self, now: int, actor: Actor, kind: ChangeKind) -> None:  # noqa: ARG002
        """Publish the automaton's state soon."""
        self._dirty.add(actor.automaton.id)
        self._wake.set()

    def fired(self, actor: Actor, transition: Transition, at: int) -> None:  # noqa: ARG002
        """Publish the transition soon."""
        self._fired.append((self._node.clock(), actor, transition))
        self._wake.set()

    # Requests from ROS

    def _handler(self, act: Callable[[], object]) -> Callable[[Any], dict[str, object]]:
        """Return the handler of a service that performs an action and reports the outcome."""

        def handle(_request: Any) -> dict[str, object]:  # noqa: ANN401
            try:
                said = act()
            except (hfsm.NoSuchElement, hfsm.InvalidValue) as error:
                return {"success": False, "message": error.what}
            except hfsm.ReloadRefused as error:
                return {"success": False, "message": error.reason}
            self._dirty.update(self._paths)
            self._wake.set()
            return {"success": True, "message": str(said or self._word())}

        return handle

    def _step(self) -> None:
        if self._runtime.status is not hfsm.ComponentStatus.Paused:
            status = self._word()
            raise hfsm.InvalidValue(sentence(f"the component is {status}: pause it first"))
        self._monitor.servant.step(0)

    def _reload(self) -> str:
        report = self._monitor.servant.reload()
        return "; ".join((f"generation {report.generation}", *report.notKept))

    def _set_parameter(self, name: str, value: object) -> None:
        try:
            self._monitor.servant.setVariable(0, name, msgspec.json.encode(value).decode())
        except (hfsm.NoSuchElement, hfsm.InvalidValue) as error:
            raise ValueError(error.what) from error
        self._parameters[name] = value  # the node is about to set it, too

    # Publishing

    def _publish(self) -> None:
        last, beat = False, time.monotonic()
        while not last:
            if self._wake.wait(_HEARTBEAT):
                time.sleep(_GATHERING)
            self._wake.clear()
            last = self._closing
            everything = last or time.monotonic() - beat >= _HEARTBEAT
            beat = time.monotonic() if everything else beat
            try:
                self._publish_changes(everything=everything)
            except (RosError, ComponentError):
                _logger.exception("the component cannot be shown in ROS")

    def _publish_changes(self, *, everything: bool) -> None:
        if self._runtime.reloads != self._generation:
            self._renew()
            return
        while self._fired:
            self._publish_transition(*self._fired.popleft())
        if everything and self._structure.subscribers:
            self._publish_structure()
        dirty = {self._dirty.pop() for _ in range(len(self._dirty))}
        actors = self._runtime.tree.actors
        everything = everything and (self._closing or self._status.subscribers > 0)
        for actor in actors if everything else [actor for actor in actors if actor.automaton.id in dirty]:
            self._publish_status(actor)
        self._renew_parameters()

    def _renew(self) -> None:
        """Show the automata, events and parameters of the component as it is now."""
        with self._runtime.tree.lock:
            self._generation = self._runtime.reloads
            self._paths = {}
            for actor in self._runtime.tree.actors:
                self._paths[actor.automaton.id] = self._path(actor)
        self._publish_structure()
        for actor in self._runtime.tree.actors:
            self._publish_status(actor)
        self._renew_events()
        self._renew_parameters()

    def _renew_events(self) -> None:
        names = {event for actor in self._runtime.tree.actors for event in actor.automaton.events}
        services: dict[str, str] = {}
        for name in sorted(names):
            if services.setdefault(f"~/event/{_ros_name(name)}", name) != name:
                _logger.warning("ROS cannot send the event %r: another one has the same name there", name)
        wanted = {(name, service) for service, name in services.items()}
        for gone in self._events.keys() - wanted:
            self._events.pop(gone).close()
        for name, service in sorted(wanted - self._events.keys()):
            handler = self._handler(functools.partial(self._monitor.servant.sendEvent, name, ""))
            try:
                self._events[name, service] = self._node.create_service(_TRIGGER, service, handler)
            except InvalidNameError as error:
                _logger.warning("ROS cannot send the event %r: %s", name, error)

    def _renew_parameters(self) -> None:
        component = self._runtime.component
        declared, served = parameters_of(component), self._node_parameters
        for name, value in parameter_values(component).items():
            if not isinstance(value, bool | int | float | str):
                continue  # user code assigned something else
            if name not in self._parameters or type(self._parameters[name]) is not type(value):
                self._parameters[name] = value
                change = functools.partial(self._set_parameter, name)
                served.declare(name, value, declared[name].description, on_change=change)
            elif self._parameters[name] != value:
                self._parameters[name] = value
                served[name] = value

    def _publish_structure(self) -> None:
        header = {"stamp": self._node.now()}
        for actor in self._runtime.tree.actors:
            automaton = actor.automaton
            labels = _labels(automaton)
            self._structure.publish(
                header=header,
                path=self._paths.get(automaton.id, ""),  # none for a moment after a reload
                children=[labels[state.id] for state in automaton.states],
                internal_outcomes=[_label(each) for each in automaton.transitions],
                outcomes_from=[labels[each.origin] for each in automaton.transitions],
                outcomes_to=[labels[each.destination] for each in automaton.transitions],
            )

    def _publish_status(self, actor: Actor) -> None:
        with self._runtime.tree.lock:
            automaton, current = actor.automaton, actor.current
            ghost, finished = not actor.active, actor.finished  # the root, too, until it has started
        labels = _labels(automaton)
        info = self._word()
        if ghost:
            info += f", inactive in {labels[current.id]}"
        elif finished:
            info += ", finished"
        self._status.publish(
            header={"stamp": self._node.now()},
            path=self._paths.get(automaton.id, ""),
            initial_states=[labels[automaton.initial.id]],
            active_states=[] if ghost else [labels[current.id]],
            local_data=_NO_DATA,
            info=info,
        )

    def _publish_transition(self, at: int, actor: Actor, transition: Transition) -> None:
        path, labels = self._paths.get(actor.automaton.id, ""), _labels(actor.automaton)

        def end(state: int) -> dict[str, object]:
            return {"id": _small(state), "label": f"{path}/{labels.get(state, state)}"}

        timed = "timestamp" in self._node.types.fields(_TRANSITION)  # in distributions before Lyrical
        self._transitions.publish(
            {"timestamp": at} if timed else {"stamp": self._node.time(at)},
            transition={"id": _small(transition.id), "label": _label(transition)},
            start_state=end(transition.origin),
            goal_state=end(transition.destination),
        )

    def _path(self, actor: Actor) -> str:
        """Return the path of an automaton: those above it are in `_paths` already."""
        if actor.parent is None or actor.owner is None:
            return f"/{_part(actor.automaton.name) or 'component'}"
        above = f"{self._paths[actor.parent.automaton.id]}/{_labels(actor.parent.automaton)[actor.owner.id]}"
        return above if len(actor.owner.children) == 1 else f"{above}:{actor.automaton.id}"

    def _word(self) -> str:
        return self._runtime.status.name.lower()


def _labels(automaton: Automaton) -> dict[int, str]:
    """Return the name of each state by its id, with the id where names are the same."""
    names = {state.id: _part(state.name) for state in automaton.states}
    count = Counter(names.values())
    return {key: name if name and count[name] == 1 else f"{name}:{key}" for key, name in names.items()}


def _label(transition: Transition) -> str:
    return _part(transition.name) or transition.event or _part(transition.condition) or str(transition.id)


def _part(name: str) -> str:
    """Return a name that can stand in a path."""
    return name.replace("/", "_").replace("\0", "").strip()


def _ros_name(event: str) -> str:
    """Return the name of an event as ROS allows it: letters, digits and single `_`."""
    plain = re.sub(r"[\W_]+", "_", event, flags=re.ASCII).strip("_")
    return plain if plain[:1].isalpha() else f"e{plain}"


def _small(id: int) -> int:
    return id if 0 <= id <= _LARGEST_ID else 0
