"""Give every entry point of the protocol hostile input, which must be accepted or rejected with our errors.

python benchmarks/fuzz_wire.py [DOOR ...] [--seconds SECONDS] [--seed NUMBER]

Each entry point (door) runs in a separate process for SECONDS; an input may take at most a second and half a
gigabyte. If atheris is installed (`pip install atheris`), inputs are mutated by the code and comparisons that
they reach; otherwise they are random. An input that fails is kept in fuzz_findings/.
"""

from __future__ import annotations

import argparse
import importlib.util
import resource
import subprocess
import sys
import tempfile
import time
from contextlib import nullcontext
from pathlib import Path

_GUIDED = importlib.util.find_spec("atheris") is not None
_FINDINGS = Path("fuzz_findings")
_LONGEST_INPUT = 1 << 16
_SLOWEST = 1.0  # s that one input may take
_MEMORY = 512  # MB
_ENDING = 120.0  # s for the start and the end of a process
_MUTATED_BY_BYTES = 0.5  # share of the inputs that atheris mutates by bytes; we mutate the others by values


def main() -> None:
    """Try the named doors, or all, and exit with 1 if there are failures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("doors", nargs="*", metavar="DOOR")
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.here:
        _try(options.doors[0], options.seconds, options.seed)
        return
    from tests.support.wire_doors import DOORS

    if unknown := set(options.doors) - set(DOORS):
        parser.error(f"unknown door {', '.join(sorted(unknown))}; there are {', '.join(DOORS)}")
    print(f"| door ({'guided by atheris' if _GUIDED else 'random'}) | inputs | inputs/s | peak MB | result |")
    print("|---|---|---|---|---|")
    failed = False
    for name in options.doors or DOORS:
        command = [sys.executable, __file__, name, "--here"]
        command += ["--seconds", str(options.seconds), "--seed", str(options.seed)]
        output, found = _run(command, options.seconds + _ENDING)
        row = [line for line in output.splitlines() if line.startswith("stat::")]
        figures = {line.split()[0]: int(line.split()[-1]) for line in row}
        inputs = figures.get("stat::number_of_executed_units:", 0)
        peak = figures.get("stat::peak_rss_mb:", 0)
        failed = failed or found
        result = "FOUND" if found else "nothing"
        print(f"| {name} | {inputs} | {inputs // options.seconds} | {peak} | {result} |", flush=True)
        if found:
            print(output[-6000:], file=sys.stderr)
    sys.exit(failed)


def _run(command: list[str], limit: float) -> tuple[str, bool]:
    """Run a command with a limit in s; return its output, and whether it failed."""
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
    )
    with process:
        try:
            output, _ = process.communicate(timeout=limit)
            return output, process.returncode != 0
        except subprocess.TimeoutExpired:
            process.kill()
            output, _ = process.communicate()
            return f"{output}\nit did not end", True


def _try(name: str, seconds: int, seed: int) -> None:
    """Try one door in this process, and exit; figures go to stderr in libFuzzer's format."""
    if _GUIDED:
        import atheris

        instrumenting = atheris.instrument_imports(include=["zenoh_ice"])
    else:
        instrumenting = nullcontext()
    with instrumenting:  # everything that imports zenoh_ice
        from tests.support.hostile_bytes import HostileBytes, bombs
        from tests.support.wire_doors import find_door
    door = find_door(name)
    sound = [*door.sound, *bombs()]
    hostile = HostileBytes(seed)
    _FINDINGS.mkdir(exist_ok=True)
    if not _GUIDED:
        count, end = 0, time.monotonic() + seconds
        while time.monotonic() < end:
            data = hostile.next_input(sound)
            begin = time.perf_counter()
            try:
                door.take(data)
                assert time.perf_counter() - begin < _SLOWEST, "too slow"
            except BaseException:
                (_FINDINGS / f"{name}-{count}").write_bytes(data)
                raise
            count += 1
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
        assert peak < _MEMORY, f"{peak} MB"
        print(f"stat::number_of_executed_units: {count}\nstat::peak_rss_mb: {peak}", file=sys.stderr)
        return

    def breed(data: bytes, longest: int, number: int) -> bytes:
        if number % 100 < _MUTATED_BY_BYTES * 100:
            return bytes(atheris.Mutate(data, longest))
        return hostile.next_input([data])[:longest]

    with tempfile.TemporaryDirectory() as corpus:
        for number, data in enumerate(sound):
            (Path(corpus) / str(number)).write_bytes(data[:_LONGEST_INPUT])
        arguments = [
            sys.argv[0],
            f"-max_total_time={seconds}",
            f"-seed={seed}",
            f"-max_len={_LONGEST_INPUT}",
            f"-timeout={int(_SLOWEST)}",
            f"-rss_limit_mb={_MEMORY}",
            "-print_final_stats=1",
            f"-artifact_prefix={_FINDINGS}/{name}-",
            corpus,
        ]
        atheris.Setup(arguments, door.take, custom_mutator=breed)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
