"""Measure calls and streams compared with Ice: every required figure, in one run.

Servers and clients are separate processes on loopback; those of Ice, of zenoh_ice and of plain Zenoh
alternate in rounds. Each section is saved when it is complete, so that `--missing` continues an interrupted
run. The report contains all saved sections.

    python benchmarks/bench_transport.py                        everything; 20 minutes of it are the soak
    python benchmarks/bench_transport.py --only calls,images    some sections again
    python benchmarks/bench_transport.py --missing              the sections without results
    python benchmarks/bench_transport.py --quick --soak-minutes 1 --results DIRECTORY    a short trial
    python benchmarks/bench_transport.py --report               only write the report again

Ice comes with `pip install -e '.[bench]'`.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.metadata
import importlib.util
import os
import platform
import subprocess
import sys
import time
from pathlib import Path
from typing import Final

import psutil

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from benchmarks.transport import report  # noqa: E402
from benchmarks.transport.figures import Effort, Section  # noqa: E402
from benchmarks.transport.plot import draw  # noqa: E402
from benchmarks.transport.processes import generated_package  # noqa: E402

SECTIONS: Final = ("calls", "images", "streams", "clients", "joints", "beside", "soak")
RESULTS: Final = HERE / "results"
DISTURBED: Final = 5.0
"""Load of other processes before a section, in percent, above which its figures are doubtful."""


def main() -> None:
    options = _options()
    kept = options.results / "transport"
    if not options.report:
        if importlib.util.find_spec("Ice") is None:
            sys.exit(
                "Ice is missing: pip install -e '.[bench]' (it is built from source, which takes minutes)"
            )
        wanted = [name for name in options.only if not (options.missing and (kept / f"{name}.json").exists())]
        effort = Effort(options.quick, options.soak_minutes)
        with generated_package() as package:
            for name in wanted:
                section = _measure(name, package, effort)
                section.save(kept / f"{name}.json")
                report.show_details(section)
    sections = {
        name: Section.load(kept / f"{name}.json") for name in SECTIONS if (kept / f"{name}.json").exists()
    }
    if not sections:
        sys.exit(f"nothing has been measured yet in {kept}")
    plot = options.results / "transport.png"
    draw(sections, plot)
    report.write_markdown(list(sections.values()), options.results / "transport.md", plot)
    report.show(list(sections.values()))


def _measure(name: str, package: Path, effort: Effort) -> Section:
    others = psutil.cpu_percent(interval=2.0)
    load = f" while other processes take {others:.0f} % of the machine" if others > DISTURBED else ""
    print(f"measuring {name}{load}", flush=True)
    begin = time.monotonic()
    section: Section = importlib.import_module(f"benchmarks.transport.{name}").measure(package, effort)
    section.run = {
        "when": time.strftime("%Y-%m-%d %H:%M", time.gmtime()) + " UTC",
        "took": f"{time.monotonic() - begin:.0f} s",
        "how": ("a short trial" if effort.quick else "a full run") + load.replace("take", "took"),
        "on": _machine(),
    }
    return section


def _machine() -> str:
    info = Path("/proc/cpuinfo")
    models = [
        line.partition(":")[2].strip() for line in info.read_text().splitlines() if "model name" in line
    ]
    versions = [f"{name} {importlib.metadata.version(name)}" for name in ("eclipse-zenoh", "zeroc-ice")]
    commit = subprocess.run(
        ["git", "describe", "--always", "--dirty"],
        cwd=HERE,
        capture_output=True,
        text=True,
        timeout=10,
        check=False,
    ).stdout.strip()
    return (
        f"{os.cpu_count()} cores, {models[0] if models else platform.machine()}, {platform.system()} "
        f"{platform.release()}, Python {platform.python_version()}, {', '.join(versions)}, commit {commit}"
    )


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", type=_names, default=SECTIONS, help=f"of {','.join(SECTIONS)}")
    parser.add_argument("--missing", action="store_true", help="skip sections that have results")
    parser.add_argument("--quick", action="store_true", help="an eighth of the rounds: a trial, no figures")
    parser.add_argument("--soak-minutes", type=float, default=20.0)
    parser.add_argument("--results", type=Path, default=RESULTS, help="directory to write to")
    parser.add_argument("--report", action="store_true", help="measure nothing, only write the report again")
    return parser.parse_args()


def _names(text: str) -> tuple[str, ...]:
    names = tuple(text.split(","))
    for name in names:
        if name not in SECTIONS:
            raise argparse.ArgumentTypeError(f"there is no section {name!r}, only {', '.join(SECTIONS)}")
    return names


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        print("interrupted; `--missing` continues with the remaining sections", file=sys.stderr)
        sys.exit(130)
