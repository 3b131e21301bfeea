"""Measure calls and streams: a generated proxy beside the bare Zenoh querier and, where it is installed, Ice.

Servers are processes of their own, on loopback; the rounds of all of them alternate in random order and the
first is not counted. The proxies are generated from bench_calls.ice when the benchmark starts.

    python benchmarks/bench_calls.py [--rounds 10] [--calls 300] [--json FILE]

Ice is measured when `pip install zeroc-ice` was done. It has its memory tuned as its users do for images:
without that each of its 3.7 MB replies costs several times as much. The others run under the same tuning.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import json
import os
import random
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import msgpack
import zenoh
from rich.console import Console
from rich.table import Table

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from tests.support.processes import free_endpoint  # noqa: E402
from zenoh_ice import Current, initialize  # noqa: E402

SLICE = HERE / "bench_calls.ice"
SIZES = ((320, 240), (1280, 960))
POSE = (0.1, 0.2, 0.3, 0.4)
TUNED_MEMORY = {"MALLOC_MMAP_THRESHOLD_": "134217728", "MALLOC_TRIM_THRESHOLD_": "268435456"}
LATEST_IN_ONE = 100  # the clock itself takes a tenth of a microsecond
BARE = "bare Zenoh querier"
SMALL = "4 doubles"
KINDS = ("bare", "proxy", "ice")


def image(width: int, height: int) -> bytes:
    return random.Random(width).randbytes(3 * width * height)


# Servers, each the whole work of a process.


def serve_bare(endpoint: str) -> Iterator[None]:
    images = {f"{width}x{height}": image(width, height) for width, height in SIZES}
    with open_bare(listen=[endpoint]) as session:

        def step(query: zenoh.Query) -> None:
            with query:
                query.reply(query.key_expr, msgpack.packb(msgpack.unpackb(bytes(query.payload or b""))))

        def get_image(query: zenoh.Query) -> None:
            with query:
                query.reply(query.key_expr, images[str(query.payload)])

        queryables = [
            session.declare_queryable("bench/step", step),
            session.declare_queryable("bench/image", get_image),
        ]
        yield
        for queryable in queryables:
            queryable.undeclare()


def serve_proxy(endpoint: str) -> Iterator[None]:
    images = {size: image(*size) for size in SIZES}
    with generated_interface() as bench:

        class RobotI(bench.Robot):  # type: ignore[misc,name-defined]
            def step(self, angles: Any, current: Current) -> Any:  # noqa: ARG002, ANN401
                return angles

            def image(self, width: int, height: int, current: Current) -> bytes:  # noqa: ARG002
                return images[width, height]

        with initialize(listen=[endpoint], connect=[], clock="wall") as communicator:
            adapter = communicator.createObjectAdapter("Bench")
            robot = RobotI()
            adapter.add(robot, "Robot")
            adapter.activate()
            yield


def serve_ice(endpoint: str) -> Iterator[None]:
    bench, ice = load_ice()
    images = {size: image(*size) for size in SIZES}

    class RobotI(bench.Robot):  # type: ignore[misc,name-defined]
        def step(self, angles: Any, current: Any) -> Any:  # noqa: ARG002, ANN401
            return angles

        def image(self, width: int, height: int, current: Any) -> bytes:  # noqa: ARG002, ANN401
            return images[width, height]

    with ice.initialize(ice_properties(ice)) as communicator:
        adapter = communicator.createObjectAdapterWithEndpoints("Bench", ice_endpoint(endpoint))
        adapter.add(RobotI(), ice.stringToIdentity("Robot"))
        adapter.activate()
        yield


SERVERS: dict[str, Callable[[str], Iterator[None]]] = {
    "bare": serve_bare,
    "proxy": serve_proxy,
    "ice": serve_ice,
}


def serve(kind: str, endpoint: str) -> None:
    for _ in SERVERS[kind](endpoint):
        print("ready", flush=True)
        sys.stdin.read()  # until the benchmark closes it


# Clients, all in the process that measures.


@dataclass
class Subject:
    """Something to call, and how long its calls took in s."""

    name: str
    size: str
    call: Callable[[], object]
    calls: int
    in_one: int = 1
    """How often `call` does what is measured."""
    times: list[float] = field(default_factory=list)

    def run(self, *, counted: bool) -> None:
        """Call again and again; note how long each took."""
        times = []
        clock, call = time.perf_counter, self.call
        for _ in range(self.calls):
            start = clock()
            call()
            times.append((clock() - start) / self.in_one)
        if counted:
            self.times += times


@contextmanager
def bare_subjects(endpoint: str, calls: int) -> Iterator[list[Subject]]:
    with open_bare(connect=[endpoint]) as session:
        step = session.declare_querier("bench/step", timeout=2.0)
        get_image = session.declare_querier("bench/image", timeout=2.0)

        def call_step() -> object:
            for reply in step.get(payload=msgpack.packb(POSE)):
                if reply.ok is not None:
                    return msgpack.unpackb(reply.ok.payload.to_bytes())
            raise RuntimeError("no reply")

        def call_image(size: str) -> object:
            for reply in get_image.get(payload=size):
                if reply.ok is not None:
                    return reply.ok.payload.to_bytes()
            raise RuntimeError("no reply")

        wait_until_it_works(call_step)
        yield [
            Subject(BARE, SMALL, call_step, calls),
            *(
                Subject(BARE, f"image {size}", partial(call_image, size), calls // 3)
                for size in (f"{width}x{height}" for width, height in SIZES)
            ),
        ]
        step.undeclare()
        get_image.undeclare()


@contextmanager
def proxy_subjects(endpoint: str, calls: int) -> Iterator[list[Subject]]:
    with (
        generated_interface() as bench,
        initialize(connect=[endpoint], clock="wall") as communicator,
        latest_subject(bench, calls) as latest,
    ):
        robot = bench.RobotPrx.checkedCast(communicator.stringToProxy("Robot"))
        angles = bench.Angles(*POSE)
        yield [*call_subjects("generated proxy", robot, angles, calls), latest]


def call_subjects(name: str, robot: Any, angles: Any, calls: int) -> Iterator[Subject]:  # noqa: ANN401
    yield Subject(name, SMALL, partial(robot.step, angles), calls)
    for width, height in SIZES:
        yield Subject(name, f"image {width}x{height}", partial(robot.image, width, height), calls // 3)


@contextmanager
def latest_subject(bench: Any, calls: int) -> Iterator[Subject]:  # noqa: ANN401
    """Give `latest()` of a stream that has brought a sample."""

    class Streaming(bench.Robot):  # type: ignore[misc]
        step = image = lambda *_: None

    endpoint = free_endpoint()
    with (
        initialize(listen=[endpoint], connect=[], clock="wall") as server,
        initialize(connect=[endpoint], clock="wall") as client,
    ):
        adapter = server.createObjectAdapter("Bench")
        servant = Streaming()
        adapter.add(servant, "Streaming")
        adapter.activate()
        proxy = bench.RobotPrx.checkedCast(client.stringToProxy("Streaming"))
        proxy.step.latest()
        servant.stepPublisher.wait_for_listener(5.0)
        servant.stepPublisher.publish(bench.Angles(*POSE))
        proxy.step.latest()

        def call() -> None:
            for _ in range(LATEST_IN_ONE):
                proxy.step.latest()

        yield Subject("proxy.step.latest()", "newest sample", call, calls // 3, LATEST_IN_ONE)


@contextmanager
def ice_subjects(endpoint: str, calls: int) -> Iterator[list[Subject]]:
    bench, ice = load_ice()
    with ice.initialize(ice_properties(ice)) as communicator:
        proxy = communicator.stringToProxy(f"Robot:{ice_endpoint(endpoint)}")
        robot = bench.RobotPrx.checkedCast(proxy)
        angles = bench.Angles(*POSE)
        yield list(call_subjects("Ice", robot, angles, calls))


SUBJECTS = {"bare": bare_subjects, "proxy": proxy_subjects, "ice": ice_subjects}


# What they need.


def open_bare(listen: list[str] | None = None, connect: list[str] | None = None) -> zenoh.Session:
    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", json.dumps(listen or ["tcp/127.0.0.1:0"]))
    config.insert_json5("connect/endpoints", json.dumps(connect or []))
    return zenoh.open(config)


@contextmanager
def generated_interface() -> Iterator[Any]:
    """Generate the proxies from the Slice file, in a folder of their own, and import them."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "bench.idl"
        shutil.copy(SLICE, source)
        package = Path(folder) / "bench_generated"
        subprocess.run(
            [sys.executable, "-m", "codegen", str(source), "-o", str(package)],
            cwd=HERE.parent,
            check=True,
            capture_output=True,
        )
        sys.path.insert(0, folder)
        try:
            yield importlib.import_module("bench_generated.Bench")
        finally:
            sys.path.remove(folder)


def load_ice() -> tuple[Any, Any]:
    ice = importlib.import_module("Ice")
    ice.loadSlice(f"--all -I{HERE} {SLICE}")
    return importlib.import_module("Bench"), ice


def ice_properties(ice: Any) -> Any:  # noqa: ANN401
    data = ice.InitializationData()
    data.properties = ice.createProperties()
    data.properties.setProperty("Ice.MessageSizeMax", "0")
    return data


def ice_endpoint(endpoint: str) -> str:
    host, port = endpoint.removeprefix("tcp/").split(":")
    return f"tcp -h {host} -p {port}"


def wait_until_it_works(call: Callable[[], object], limit: float = 5.0) -> None:
    deadline = time.monotonic() + limit
    while True:
        try:
            call()
        except RuntimeError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.02)
        else:
            return


@contextmanager
def server(kind: str) -> Iterator[str]:
    """Run a server as a process; give its endpoint."""
    endpoint = free_endpoint()
    command = [sys.executable, __file__, "--serve", kind, "--endpoint", endpoint]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            if process.stdout.readline().strip() != "ready":
                raise RuntimeError(f"the {kind} server did not start")
            yield endpoint
        finally:
            process.stdin.close()
            process.wait(10)


def measure(rounds: int, calls: int, kinds: list[str]) -> list[dict[str, Any]]:
    with ExitStack() as stack:
        subjects: list[Subject] = []
        for kind in kinds:
            endpoint = stack.enter_context(server(kind))
            subjects += stack.enter_context(SUBJECTS[kind](endpoint, calls))
        for number in range(rounds + 1):
            for subject in random.sample(subjects, len(subjects)):
                subject.run(counted=number > 0)
        return [summary(subject, subjects) for subject in subjects]


def summary(subject: Subject, subjects: list[Subject]) -> dict[str, Any]:
    ordered = sorted(subject.times)
    bare = next((other for other in subjects if other.name == BARE and other.size == subject.size), subject)
    p50 = statistics.median(ordered)
    p50_bare = statistics.median(bare.times)
    comparable = bare.size == subject.size and bare.name == BARE
    return {
        "subject": subject.name,
        "what": subject.size,
        "p50_us": p50 * 1e6,
        "p99_us": ordered[int(len(ordered) * 0.99)] * 1e6,
        "over_bare_us": (p50 - p50_bare) * 1e6 if comparable else None,
        "times_bare": p50 / p50_bare if comparable else None,
        "calls": len(ordered),
    }


def show(rows: list[dict[str, Any]]) -> None:
    table = Table("what", "subject", title="Calls over loopback, wall time")
    for heading in ("p50 us", "p99 us", "over bare us", "times bare"):
        table.add_column(heading, justify="right")
    for row in sorted(rows, key=lambda row: (row["what"], row["p50_us"])):
        over, times = row["over_bare_us"], row["times_bare"]
        table.add_row(
            row["what"],
            row["subject"],
            f"{row['p50_us']:.2f}",
            f"{row['p99_us']:.2f}",
            "" if over is None else f"{over:+.1f}",
            "" if times is None else f"{times:.2f}",
        )
    Console(width=100).print(table)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--calls", type=int, default=300, help="small calls in a round; images a third")
    parser.add_argument("--json", type=Path, help="write the figures here, too")
    parser.add_argument("--serve", choices=KINDS, help=argparse.SUPPRESS)
    parser.add_argument("--endpoint", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        serve(options.serve, options.endpoint)
        return
    if not TUNED_MEMORY.items() <= os.environ.items():  # read by the C library when a process starts
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **TUNED_MEMORY})
    kinds = [kind for kind in KINDS if kind != "ice" or importlib.util.find_spec("Ice")]
    rows = measure(options.rounds, options.calls, kinds)
    show(rows)
    if "ice" not in kinds:
        print("Ice was not measured: pip install zeroc-ice")
    if options.json:
        options.json.write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
