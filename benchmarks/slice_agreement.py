"""Print how often `codegen` agrees with slice2py on the test cases and on generated files.

    python benchmarks/slice_agreement.py [--generated COUNT] [--seed NUMBER] [-I DIR] [FILES.ice...]

The given files are compared separately. Differences are listed below the table.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from tests.support.slice_agreement import Agreement, compare, compare_generated
from tests.support.slice_cases import all_cases


def main() -> None:
    """Compare and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--generated",
        type=int,
        default=1000,
        metavar="COUNT",
        help="number of files to generate from the grammar",
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the generated files")
    parser.add_argument(
        "-I",
        dest="include",
        action="append",
        default=[],
        type=Path,
        metavar="DIR",
        help="directory that the further files include files from; can be repeated",
    )
    parser.add_argument("files", nargs="*", type=Path, help="further files, with the extension .ice")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        root = Path(directory)
        paths = [case.write(root / "cases" / str(number)) for number, case in enumerate(all_cases())]
        rows = {"test cases": compare(paths, root / "out")}
        generated = root / "generated"
        generated.mkdir()
        rows["generated"] = compare_generated(generated, arguments.generated, arguments.seed)
        if arguments.files:
            rows["given files"] = compare(arguments.files, root / "out", arguments.include)
    _print(rows)


def _print(rows: dict[str, Agreement]) -> None:
    titles = ("files", "accepted", "by ours, too", "by ours alone", "same first line")
    print(f"{'':20}", *(f"{title:>15}" for title in titles))
    for name, row in rows.items():
        counts = f"{row.files:15} {row.accepted:15} {row.acceptance:15.2%} {row.wrongly_accepted:15}"
        print(f"{name:20} {counts} {row.first_lines:15.2%}")
    for row in rows.values():
        for difference in row.differences:
            print(difference)


if __name__ == "__main__":
    main()
