"""Names of a package that are imported when they are first used."""

from __future__ import annotations

import decimal
import json.decoder

import pytest

from zenoh_ice.lazy import import_on_use

LOAD, COMPLETE = import_on_use("json", {".decoder": "JSONDecoder Renamed", "decimal": "Decimal"})


def test_a_name_is_found_in_a_module_of_the_package_and_of_another() -> None:
    assert LOAD("JSONDecoder") is json.decoder.JSONDecoder
    assert LOAD("Decimal") is decimal.Decimal


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'json' has no attribute 'JSONDecodr'"):
        LOAD("JSONDecodr")


def test_a_name_that_its_module_lacks_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match=r"json\.decoder"):
        LOAD("Renamed")


def test_the_names_are_offered_beside_those_that_are_there() -> None:
    assert {"JSONDecoder", "Renamed", "Decimal", "dumps", "__name__"} <= {*COMPLETE()}
