"""An authority for the tests, created in each run, and components with its certificates."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path

from nao_tools._deployment.admission import LIMITS, AdmissionLimits
from nao_tools._security.folder import SecurityFolder
from tests.support.ports import free_port
from tests.support.processes import ComponentProcess
from zenoh_ice.settings import Settings, load_settings

__all__ = ["Keys", "routing"]

_ROUTER = """
import logging, pickle, sys
from zenoh_ice.application import end_at_ctrl_c
end_at_ctrl_c()
from nao_tools._deployment.router import serve
settings, limits = pickle.loads(bytes.fromhex(sys.argv[1]))
logging.basicConfig(level=logging.WARNING)
serve(settings, lambda line: print("ready", flush=True), limits)
"""


@contextmanager
def routing(settings: Settings, limits: AdmissionLimits = LIMITS) -> Iterator[ComponentProcess]:
    """Run a router in a separate process: what it forwards must not wait for its senders' threads."""
    with ComponentProcess([sys.executable, "-c", _ROUTER, pickle.dumps((settings, limits)).hex()]) as router:
        router.wait_for("^ready")
        yield router


class Keys:
    """The folder of an authority, whose router listens on a free port of loopback."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        port = free_port()
        self.endpoint = f"tls/127.0.0.1:{port}"
        self.other_endpoint = f"tls/127.0.0.2:{port}"
        """Another address of the router, which its certificate does not name."""
        self.security = SecurityFolder(folder)
        self.security.create(realm="nao", hosts=["127.0.0.1"], port=port, valid=timedelta(days=1))

    def settings(self, name: str, **changes: object) -> Settings:
        """Return the settings of the router or of a user, with some changes."""
        if name == "router":
            changes = {"listen": [self.endpoint, self.other_endpoint], **changes}
        return load_settings(self.folder / f"{name}.toml", defaults={"clock": "wall"}).override(**changes)

    def issue(self, name: str, *, valid: timedelta = timedelta(days=1)) -> Settings:
        """Return the settings of a new user with the role of a student."""
        self.security.add(name, "student", valid=valid)
        return self.settings(name)

    def add_role(self, name: str, table: str) -> None:
        """Give the router a role, as the lines of its table, and a user of the same name."""
        file = self.folder / "router.toml"
        before, section, users = file.read_text("utf-8").partition("[security.users]")
        file.write_text(f"{before}[security.roles.{name}]\n{table}\n{section}{users}", "utf-8")
        self.security.add(name, name, valid=timedelta(days=1))
