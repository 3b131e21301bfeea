"""The conformance suite that is shipped, on a Nao over NAOqi."""

from __future__ import annotations

from naoserver.bodies.nao import H21, H25
from plugins.naoqi.tests.support.robots import naoqi
from tests.support.conformance import Implementation
from tests.support.conformance_suite import SUITE, parametrize
from tests.support.soak import cases

globals().update(SUITE)
del globals()["test_a_joint_follows_a_command_with_gains_until_the_next_one"]  # NAOqi takes none


def naos(able, bodies, weight):
    """Return the parameters of a test; an H21 differs from an H25 as it does without NAOqi."""
    h25, h21 = (
        [Implementation(naoqi, nao).parameter] if nao in bodies and able(nao) else [] for nao in (H25, H21)
    )
    return cases(h25, h21)


def pytest_generate_tests(metafunc):
    parametrize(metafunc, naos)
