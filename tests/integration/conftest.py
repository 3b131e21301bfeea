"""Fixtures of tests that call a servant over Zenoh; a file may have others of the same names."""

from __future__ import annotations

import pytest

from tests.support.calculator import CalculatorPrx
from tests.support.calculator_servant import CalculatorI
from tests.support.suite import Pair


@pytest.fixture
def servant(pair: Pair) -> CalculatorI:
    """What the server of the pair serves as `Calculator`."""
    servant = CalculatorI()
    pair.adapter.add(servant, "Calculator")
    return servant


@pytest.fixture
def calculator(pair: Pair, servant: CalculatorI) -> CalculatorPrx:
    """The proxy of the pair's client to it."""
    return CalculatorPrx.checkedCast(pair.client.stringToProxy("Calculator"))
