from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.examples import examples
from tests.support.slice_fuzz import Fuzzer, examine


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_hostile_input_is_refused_with_a_reason_or_compiled(tmp_path: Path, seed: int) -> None:
    fuzzer = Fuzzer(seed)
    for _ in range(examples(40)):
        examine(fuzzer.next_input(), tmp_path)
