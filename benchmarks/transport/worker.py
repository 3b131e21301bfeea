"""A process of the benchmark: a server or a client that executes commands, one line of JSON each.

It ends when its standard input is closed.
"""

from __future__ import annotations

import argparse
import gc
import json
import logging
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from . import peers
from .client_tasks import ClientTasks
from .server_tasks import ServerTasks
from .soak_client import SoakClient
from .soak_server import SoakServer


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("role", choices=("server", "client", "soak-server", "soak-client"))
    parser.add_argument("kind", choices=peers.KINDS)
    parser.add_argument("endpoints", nargs="+")
    parser.add_argument("--package", type=Path, required=True)
    parser.add_argument("--identity", required=True)
    options = parser.parse_args()
    logging.basicConfig(level=logging.ERROR, format="%(levelname)s %(name)s: %(message)s")
    # Answers go to the original standard output; everything else that is printed goes to standard error.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    with _tasks(**vars(options)) as tasks:
        gc.collect()
        gc.freeze()
        _answer(answers, {"ready": True})
        for line in sys.stdin:
            command = json.loads(line)
            task: Callable[..., Any] = getattr(tasks, command.pop("do"))
            try:
                _answer(answers, {"result": task(**command)})
            except Exception as error:  # noqa: BLE001 - reported to the process that sent the command
                _answer(answers, {"error": f"{type(error).__name__}: {error}"})


def _tasks(role: str, kind: str, endpoints: list[str], package: Path, identity: str) -> Any:  # noqa: ANN401
    if role == "soak-server":
        return SoakServer(endpoints[0], package, identity)
    if role == "soak-client":
        return SoakClient(endpoints, package)
    if role == "server":
        return ServerTasks(peers.serve(kind, endpoints[0], package))
    return ClientTasks(peers.connect(kind, endpoints, package))


def _answer(stream: Any, answer: dict[str, Any]) -> None:  # noqa: ANN401
    stream.write(json.dumps(answer) + "\n")
    stream.flush()


if __name__ == "__main__":
    main()
