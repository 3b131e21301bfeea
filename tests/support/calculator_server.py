"""A process that serves a calculator and streams its readings: `python -m tests.support.calculator_server`."""

# ruff: noqa: T201 - what it prints is for the test that runs it
from __future__ import annotations

import argparse
import logging

from tests.support.calculator import Reading
from tests.support.calculator_servant import CalculatorI
from zenoh_ice import initialize


def main() -> None:
    """Serve until SIGINT."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--listen", default="tcp/127.0.0.1:0")
    parser.add_argument("--connect", action="append", default=[])
    parser.add_argument("--identity", default="Calculator")
    options = parser.parse_args()
    logging.basicConfig(level=logging.INFO)
    with initialize(clock="wall", listen=[options.listen], connect=options.connect) as communicator:
        communicator.onClientLost(lambda client: print(f"lost {client}", flush=True))
        adapter = communicator.createObjectAdapter("Calculator")
        servant = CalculatorI()
        adapter.add(servant, options.identity)
        adapter.add(CalculatorI(), f"Silent{options.identity}")  # never publishes
        adapter.activate()
        count = 0
        try:
            print(f"ready {communicator.client_id}", flush=True)
            while not communicator.waitForShutdown(0.02):
                count += 1
                servant.getReadingPublisher.publish(Reading(count, []))
        except KeyboardInterrupt:
            print("interrupted", flush=True)


if __name__ == "__main__":
    main()
