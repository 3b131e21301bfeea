"""The entry of `nao`: it ends quietly while modules load."""

from __future__ import annotations

from typing import NoReturn

from startup import loading


def main() -> NoReturn:
    """Run the command `nao`."""
    with loading():
        from deploy.nao.command import app
        from deploy.nao.errors import NaoError
        from zenoh_ice.command import run
    run(app, expected=(NaoError,))
