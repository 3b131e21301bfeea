"""Start the command: `nao`, or `python -m deploy.nao`."""

from __future__ import annotations

import os
from typing import NoReturn

import hfsm_command


def main() -> NoReturn:
    """Run the command."""
    hfsm_command.begin_loading()
    from deploy.nao.command import app
    from deploy.nao.completion import join_words
    from hfsm_command.cli import run

    if os.environ.get("_NAO_COMPLETE") == "complete_bash":
        join_words(os.environ)
    run(app)


if __name__ == "__main__":
    main()
