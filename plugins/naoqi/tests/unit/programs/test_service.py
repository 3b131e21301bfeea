"""Whatever a client sends, an operation accepts it or refuses it with an error that explains why."""

import inspect
from contextlib import suppress

import pytest

pytest.importorskip("qi")

from hypothesis import given, settings
from hypothesis import strategies as st

from naoserver.errors import RobotError
from plugins.naoqi.tests.support.rig import Rig
from tests.support.any_text import any_text
from tests.support.examples import examples
from tests.support.limits import EVENT_LIMIT
from tests.support.stepped_clock import SteppedClock
from visualhfsm_naoqi.programs._clients import Call
from visualhfsm_naoqi.programs._service import REFUSED, SERVICES

SENSIBLE = [
    "HeadYaw",
    "Body",
    "LArm",
    "Camera",
    "FaceLeds",
    "Stand",
    "RedBall",
    "a.wav",
    "Default",
    0,
    1,
    0.5,
    -1,
    True,
    [],
    [["HeadYaw"]],
]
FOREIGN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | any_text(max_size=4)
    | st.sampled_from(SENSIBLE),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(any_text(max_size=2), inner, max_size=2),
    max_leaves=6,
)


@pytest.fixture(scope="module")
def operations(tmp_path_factory):
    rig = Rig()
    rig.access.disk = tmp_path_factory.mktemp("disk")
    services = [rig.access.service(kind) for kinds in SERVICES.values() for kind in kinds]
    yield [
        getattr(service, name)
        for service in services
        for name in dir(service)
        if not name.startswith("_") and inspect.ismethod(getattr(service, name))
    ]
    rig.close()


@pytest.fixture(scope="module")
def ended():
    """A call that was cancelled before it started, so that none lasts."""
    call = Call(SteppedClock(limit=EVENT_LIMIT))
    call.stop()
    return call


@pytest.mark.slow
@settings(max_examples=examples(25))
@given(st.lists(FOREIGN, min_size=6, max_size=6))
def test_anything(operations, ended, values):
    for operation in operations:
        parameters = list(inspect.signature(operation).parameters.values())
        long = bool(parameters) and parameters[0].name == "call"
        parameters = parameters[long:]
        several = any(parameter.kind is parameter.VAR_POSITIONAL for parameter in parameters)
        arguments = [ended] * long + values[: len(parameters) + 2 * several]
        with suppress(RobotError):
            operation(*arguments)


@pytest.mark.parametrize("name", sorted(SERVICES.keys() & REFUSED.keys()))
def test_no_operation_is_both_offered_and_refused(name):
    offered = {operation for part in SERVICES[name] for operation in dir(part)}
    assert offered.isdisjoint(REFUSED[name].operations)
