"""What the tests of the code help share."""

from __future__ import annotations

from collections.abc import Iterator

import jedi
import pytest
from jedi.cache import clear_time_caches
from parso.cache import parser_cache

from visualhfsm.project._code_help.parsed_files import keep_parsed_files


@pytest.fixture(scope="package", autouse=True)
def parsed_files() -> Iterator[None]:
    """Keep parsed files where the product does, which has parsed most of them in other tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jedi.settings, "cache_directory", jedi.settings.cache_directory)
        keep_parsed_files()
        yield
    # Searching for garbage among 200,000 objects takes 0.3 s, in any test that follows.
    parser_cache.clear()
    clear_time_caches(delete_all=True)
