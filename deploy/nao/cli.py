"""The entry of `nao`: it ends quietly while modules load."""

from __future__ import annotations

from typing import NoReturn

from startup import loading


def main() -> NoReturn:
    """Run the command `nao`."""
    with loading():
        import os

        from deploy.nao import NaoError
        from deploy.nao.command import app
        from deploy.nao.completion import join_words
        from zenoh_ice.command import run
    if os.environ.get("_NAO_COMPLETE") == "complete_bash":
        join_words(os.environ)
    run(app, expected=(NaoError,))
