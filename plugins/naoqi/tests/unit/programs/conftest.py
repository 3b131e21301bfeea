"""A fake robot as NAOqi in virtual time, for the tests of the services."""

import pytest


@pytest.fixture
def rig():
    """A fake robot behind its guards."""
    from plugins.naoqi.tests.support.rig import (
        Rig,  # here: the tests of robots without libqi skip first
    )

    rig = Rig()
    yield rig
    rig.close()


@pytest.fixture
def memory(rig):
    """Its ALMemory."""
    from visualhfsm_naoqi.programs._memory import ALMemory

    return rig.access.service(ALMemory)
