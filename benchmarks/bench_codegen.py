"""Measure codegen on 36 interface files: the whole command, and only parsing.

The files are those of interfaces/, copied with other module names until there are 36. Commands run with
compiled modules, as in an installed package; the first run, which compiles them, is not counted.

    python benchmarks/bench_codegen.py [--rounds 15] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from codegen.diagnostics import Diagnostics  # noqa: E402
from codegen.idl.parser import parse  # noqa: E402
from codegen.idl.preprocessor import Preprocessor  # noqa: E402

FILES = 36
LIMITS = {"--help": 150.0, "generate": 300.0, "up to date": 300.0, "--check": 300.0, "parsing alone": 20.0}


def write_interfaces(directory: Path) -> list[Path]:
    """Write 36 files, with a directory for each copy of the project's interfaces."""
    sources = sorted((ROOT / "interfaces").glob("*.idl"))
    written: list[Path] = []
    for copy in range(-(-FILES // len(sources))):
        target = directory / f"copy{copy}"
        target.mkdir()
        for source in sources:
            text = re.sub(r"\b(jderobot|nao|hfsm)\b", rf"\g<1>{copy}", source.read_text())
            (target / source.name).write_text(text)
            written.append(target / source.name)
    return written[:FILES]


def milliseconds(function: Callable[[], object]) -> float:
    started = time.perf_counter()
    function()
    return (time.perf_counter() - started) * 1e3


def parse_all(paths: list[Path]) -> None:
    """Read and parse each file once, with its includes."""
    diagnostics = Diagnostics()
    preprocessor = Preprocessor([], diagnostics)
    for path in paths:
        source = preprocessor.load(path)
        assert source is not None
        parse(preprocessor.preprocess(source, diagnostics).tokens, diagnostics)
    assert not len(diagnostics)


def measure(directory: Path, rounds: int) -> dict[str, list[float]]:
    """Return the durations in ms of each kind of run."""
    paths = write_interfaces(directory)
    output = directory / "api"
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environment.update(PYTHONPATH=str(ROOT), PYTHONPYCACHEPREFIX=str(directory / "cache"))
    entry = [sys.executable, "-c", "from codegen.__main__ import main; main()"]

    def run(*arguments: str) -> None:
        command = [*entry, *arguments]
        # The end of the output is seen at once; waiting for the process would poll.
        subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE, timeout=60)

    everything = [*map(str, paths), "-o", str(output)]
    kinds: dict[str, Callable[[], object]] = {
        "--help": lambda: run("--help"),
        "generate": lambda: run(*everything),
        "up to date": lambda: run(*everything),
        "--check": lambda: run("--check", *everything),
        "parsing alone": lambda: parse_all(paths),
    }
    durations: dict[str, list[float]] = {kind: [] for kind in kinds}
    for number in range(rounds + 1):
        for kind, function in kinds.items():
            if kind == "generate":
                shutil.rmtree(output, ignore_errors=True)
            duration = milliseconds(function)
            if number:
                durations[kind].append(duration)
    return durations


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--json", type=Path, help="also write the durations in ms to a file")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        durations = measure(Path(directory), arguments.rounds)
    table = Table(title=f"codegen on {FILES} interface files, ms")
    for column in ("", "median", "fastest", "limit"):
        table.add_column(column, justify="right" if column else "left")
    for kind, values in durations.items():
        row = (statistics.median(values), min(values), LIMITS[kind])
        table.add_row(kind, *(f"{value:.1f}" for value in row))
    Console().print(table)
    if arguments.json:
        arguments.json.write_text(json.dumps(durations, indent=2) + "\n")


if __name__ == "__main__":
    main()
