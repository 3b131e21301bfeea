"""Programs of real Python at random: nothing that they do is called impossible."""

from __future__ import annotations

import pytest

from codegen.hfsm import write_document
from tests.support.random_python import Choices, Program
from tests.support.refuting import naive, refuted, shrunk
from tests.support.soak import cases

IN_A_BLOCK = 250
"""Programs of a test; all blocks of a soak are 20,000."""


@pytest.mark.slow
@pytest.mark.parametrize("block", cases([0], range(1, 80)))
def test_no_run_of_a_random_program_refutes_a_claim(block: int) -> None:
    claims = 0
    for seed in range(block * IN_A_BLOCK, (block + 1) * IN_A_BLOCK):
        choices = Choices(seed=seed)
        found = refuted(Program(choices))
        claims += 0 if found.failed else found.claims
        if found.refuted:
            smallest = Program(Choices(shrunk(choices.made)))
            pytest.fail(f"{refuted(smallest).refuted}, seed {seed}:\n{write_document(smallest.document)}")
    assert claims > IN_A_BLOCK / 4


@pytest.mark.slow
def test_the_programs_do_what_refutes_who_does_not_read_their_code() -> None:
    programs = [program for seed in range(100) if (program := Program(Choices(seed=seed))).aim != "constant"]
    found = [refuted(program, checked=naive(program.document)) for program in programs]
    assert sum(bool(each.refuted) for each in found) > 0.95 * len(found)
