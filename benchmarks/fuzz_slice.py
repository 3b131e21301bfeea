"""Give the Slice compiler hostile inputs: none may crash it, take a second, or be rejected without an error.

python benchmarks/fuzz_slice.py [--inputs COUNT] [--seed NUMBER]
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.support.slice_fuzz import Fuzzer, examine

_LIMIT = 1.0
"""The longest processor time of one input in s."""


def main() -> None:
    """Run and print failures; exit with 1 if there are any."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--inputs", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    fuzzer = Fuzzer(arguments.seed)
    accepted = failed = 0
    slowest = 0.0
    begin = time.process_time()
    with tempfile.TemporaryDirectory() as directory:
        for number in range(arguments.inputs):
            files = fuzzer.next_input()
            start = time.process_time()
            try:
                accepted += examine(files, Path(directory))
            except Exception as error:  # noqa: BLE001 - any exception is a failure
                failed += 1
                print(f"input {number}: {type(error).__name__}: {error}\n  {str(files)[:300]}")
            seconds = time.process_time() - start
            slowest = max(slowest, seconds)
            if seconds > _LIMIT:
                failed += 1
                print(f"input {number} took {seconds:.2f} s\n  {str(files)[:300]}")
    total = time.process_time() - begin
    print(f"{arguments.inputs} inputs in {total:.0f} s, the slowest in {slowest:.2f} s")
    print(f"{accepted} accepted, {failed} failed")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
