"""Processes whose threads convert types of the project for the first time at once: `first_conversions.py COUNT SEED...`.

There is one for each seed: that of the order, which says what is known of the types before, and of which COUNT types
there are. It prints how many types there are in all, and ends with 1 after the seeds of the processes that did not
survive.
"""

from __future__ import annotations

import importlib.util
import os
import pkgutil
import random
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from types import FrameType
from typing import Any, Final

import msgspec

from zenoh_ice.data import typed

PACKAGES: Final = [
    "ballmover",
    "codegen",
    "hfsm_runtime",
    "interfaces",
    "nao_tools",
    "naoserver",
    "naoserver_sim",
    "visualhfsm",
    "zenoh_ice",
    "visualhfsm_classes",
    "visualhfsm_cluster",
    "visualhfsm_learning",
    "visualhfsm_makers",
    "visualhfsm_naoqi",
    "visualhfsm_old_documents",
    "visualhfsm_own_robots",
    "visualhfsm_ros2",
    "zenoh_ros2",
]
"""The core, and the plug-ins as far as they are there."""
THREADS: Final = 4
READS: Final = "get_class_annotations"
"""The function of msgspec that runs while a type is half known."""


def main(count: int, *seeds: int) -> int:
    for package in filter(importlib.util.find_spec, PACKAGES):
        for module in pkgutil.walk_packages(importlib.import_module(package).__path__, f"{package}."):
            if not module.name.endswith("__main__") and ".template." not in module.name:
                with suppress(ImportError):  # of a package that is not installed
                    importlib.import_module(module.name)
    types = list(dict.fromkeys(subclasses(msgspec.Struct)))
    died = [seed for seed in seeds if not survives(types, min(count, len(types)), seed)]
    sys.stdout.write(f"{len(types)}\n{died}\n")
    return int(bool(died))


def survives(types: list[type[Any]], count: int, seed: int) -> bool:
    """Whether a process survives that knows nothing of the types yet: a child of this one, which has no threads."""
    if child := os.fork():
        return os.waitpid(child, 0)[1] == 0
    status = 1
    try:
        convert(random.Random(seed).sample(types, count))
        status = 0
    finally:
        os._exit(status)


def convert(types: list[type[Any]]) -> None:
    together = threading.Barrier(THREADS)
    sys.setswitchinterval(1e-6)
    with ThreadPoolExecutor(THREADS) as pool:
        for done in [pool.submit(convert_all, types, together) for _ in range(THREADS)]:
            done.result()


def subclasses(kind: type) -> Iterator[type[Any]]:
    each: type[Any]
    for each in kind.__subclasses__():
        yield each
        yield from subclasses(each)


def convert_all(types: list[type[Any]], together: threading.Barrier) -> None:
    sys.setprofile(linger)
    for kind in types:
        together.wait()
        # Not nested in its struct: the value of a field whose type is not known yet ends the process.
        for field in reversed(kind.__struct_encode_fields__):
            # The latter two where none is ever converted.
            with suppress(msgspec.ValidationError, TypeError, NameError):
                typed.convert({field: 0}, kind)


def linger(frame: FrameType, event: str, argument: object) -> None:
    """Give the other threads time where a type is half known."""
    if frame.f_code.co_name == READS:
        time.sleep(1e-4)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
