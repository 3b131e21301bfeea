"""What the tests of the code help share."""

from __future__ import annotations

from collections.abc import Iterator

import jedi
import pytest
from jedi.cache import clear_time_caches
from parso.cache import parser_cache


@pytest.fixture(scope="package", autouse=True)
def own_parsed_files(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep parsed files for this process alone: jedi fails at one that another process is writing.

    In the product that ends a process for code help, and `with_readable_files` asks again.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jedi.settings, "cache_directory", str(tmp_path_factory.getbasetemp() / "parsed"))
        yield
    # Searching for garbage among 200,000 objects takes 0.3 s, in any test that follows.
    parser_cache.clear()
    clear_time_caches(delete_all=True)
