"""What plug-ins use that run a component, or its code, themselves, such as in another process."""

from __future__ import annotations

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from hfsm_runtime._actor import make_event as make_event
    from hfsm_runtime._advice import explain as explain
    from hfsm_runtime._cycle import hand_over as hand_over
    from hfsm_runtime._cycle import outputs_of as outputs_of
    from hfsm_runtime._marks import Mark as Mark
    from hfsm_runtime._recording.clocks import TimeModule as TimeModule
    from hfsm_runtime._recording.run import random_state as random_state
    from hfsm_runtime._recording.run import restore_random as restore_random
    from hfsm_runtime._recording.transport import ObservedTransport as ObservedTransport
    from hfsm_runtime._robot import connect as connect
    from hfsm_runtime._variables import functions_of as functions_of
    from hfsm_runtime._variables import short_repr as short_repr
    from hfsm_runtime._variables import values_of as values_of
    from hfsm_runtime.debugger.reload import components_in as components_in
    from hfsm_runtime.loading import load_module as load_module

__getattr__, __dir__ = import_on_use(__name__)
