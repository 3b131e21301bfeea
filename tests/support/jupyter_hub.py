"""A JupyterHub on loopback, as a school runs one: its own proxy, and a Jupyter server for each user.

Users need no account of the machine, and log in with any password. In a user's browser, which is a `Login`, everything
goes through the hub's proxy.
"""

from __future__ import annotations

import contextlib
import http.cookiejar
import json
import os
import re
import shutil
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final
from urllib.error import HTTPError
from urllib.parse import quote, urlencode

import psutil
import pytest
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from tests.support.limits import CALL_LIMIT, END_LIMIT, PAGE_LIMIT, START_LIMIT
from tests.support.pages import DOCS, blocks_of
from tests.support.places import ROOT
from tests.support.ports import free_port
from tests.support.processes import ComponentProcess, module

__all__ = ["SERVER_LIMIT", "Hub", "Login", "jupyter_hub"]

SERVER_LIMIT: Final = 3.0 * START_LIMIT
"""The hub, or the Jupyter server of a user, has loaded its hundreds of modules and answers."""

_PROXY: Final = ROOT / "tests/hub/node_modules/.bin/configurable-http-proxy"
_SECRET: Final = "secret-of-the-service-that-ends-servers"
_WITHOUT: Final = "rfc3987_syntax"
"""A package that checks international addresses, which Jupyter's schemas do not have: its import takes more than half
of the work with which the hub or a user's server starts, and jsonschema does without it."""
_CONFIG: Final = """
c.JupyterHub.bind_url = "http://127.0.0.1:{port}"
c.JupyterHub.hub_port = {hub_port}
c.ConfigurableHTTPProxy.api_url = "http://127.0.0.1:{proxy_port}"
c.ConfigurableHTTPProxy.command = [{proxy!r}]
c.JupyterHub.authenticator_class = "dummy"
c.Authenticator.allow_all = True
c.JupyterHub.spawner_class = "simple"
c.SimpleLocalProcessSpawner.home_dir_template = {homes!r} + "/{{username}}"
c.Spawner.cmd = [{python!r}, "-m", "jupyterhub.singleuser"]
c.Spawner.args = ["--allow-root"]
c.Spawner.poll_interval = 1
c.Spawner.start_timeout = c.Spawner.http_timeout = {patience}
c.Spawner.environment = {environment!r}
c.JupyterHub.services = [{{"name": "culler", "api_token": {secret!r}}}]
c.JupyterHub.load_roles = [
    {{"name": "culler", "services": ["culler"], "scopes": ["list:users", "read:servers", "admin:servers"]}}
]
"""


class Login:
    """A browser in which a user has logged in, or nobody if there is no name."""

    def __init__(self, hub: Hub, name: str = "") -> None:
        self.hub = hub
        self.name = name
        self.home = hub.homes / name
        self.path = f"/user/{quote(name, safe='@')}/"
        """Where the user's server is."""
        self._cookies = http.cookiejar.CookieJar()
        cookies = urllib.request.HTTPCookieProcessor(self._cookies)
        self._opener = urllib.request.build_opener(urllib.request.ProxyHandler({}), cookies)
        if name:
            token = re.findall(r'name="_xsrf" value="([^"]+)"', self.get("/hub/login")[1])[0]
            form = urlencode({"username": name, "password": "any", "_xsrf": token}).encode()
            self._open(urllib.request.Request(f"{hub.address}/hub/login", form))

    def get(self, path: str) -> tuple[int, str]:
        """Return status and text of what a path shows in the end; redirections are followed."""
        return self._open(urllib.request.Request(f"{self.hub.address}{path}"))

    def start(self) -> None:
        """Start the user's server unless it runs, and wait until it answers."""
        if not self.hub.server(self.name):
            self.hub.ask("POST", f"users/{quote(self.name)}/server")
        self.hub.wait(lambda: self.hub.server(self.name).get("ready"), SERVER_LIMIT)

    @contextlib.contextmanager
    def socket(self, path: str, origin: str | None = None) -> Iterator[ClientConnection]:
        """Open a websocket with the cookies of this browser."""
        host = self.hub.address.removeprefix("http://")
        request = urllib.request.Request(f"{self.hub.address}{path}")
        self._cookies.add_cookie_header(request)
        cookie = request.get_header("Cookie")
        with connect(
            f"ws://{host}{path}",
            origin=Origin(origin or self.hub.address),
            additional_headers={"Cookie": cookie} if cookie else None,
            max_size=None,
            open_timeout=PAGE_LIMIT,
            close_timeout=PAGE_LIMIT,
            proxy=None,
        ) as socket:
            yield socket

    def _open(self, request: urllib.request.Request) -> tuple[int, str]:
        try:
            with self._opener.open(request, timeout=PAGE_LIMIT) as answer:
                return answer.status, answer.read().decode()
        except HTTPError as error:
            with error:
                return error.code, error.read().decode()


class Hub:
    """A hub that runs, and what its administrator does."""

    def __init__(self, process: ComponentProcess, address: str, homes: Path) -> None:
        self.process = process
        self.address = address
        self.homes = homes
        """The folder in which each user has one."""

    def login(self, name: str) -> Login:
        """Log in, and start the user's server."""
        login = Login(self, name)
        login.start()
        return login

    def ask(self, method: str, path: str) -> Any:
        """Return what the hub's API answers."""
        request = urllib.request.Request(
            f"{self.address}/hub/api/{path}", method=method, headers={"Authorization": f"token {_SECRET}"}
        )
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        try:
            with opener.open(request, timeout=PAGE_LIMIT) as answer:
                return json.loads(answer.read() or b"null")
        except HTTPError as error:
            with error:
                if error.code == 404:
                    return {}
                raise AssertionError(
                    f"{error.code}: {error.read().decode()}\n{self.process.output}"
                ) from error

    def server(self, name: str) -> dict[str, Any]:
        """Return what the hub knows of a user's server; nothing if none runs."""
        servers: dict[str, dict[str, Any]] = self.ask("GET", f"users/{quote(name)}").get("servers", {})
        return servers.get("", {})

    def stop(self, name: str) -> None:
        """End a user's server, as the user, the administrator and the culler of idle servers do."""
        self.ask("DELETE", f"users/{quote(name)}/server")
        self.wait(lambda: not self.server(name), END_LIMIT)

    def wait(self, condition: Callable[[], object], limit: float) -> None:
        """Ask a few times a second until a condition holds: each question keeps the hub busy for a while."""
        deadline = time.monotonic() + limit
        while not condition():
            assert time.monotonic() < deadline, self.process.output
            time.sleep(0.2)

    def processes(self, name: str) -> list[psutil.Process]:
        """Return the user's Jupyter server and all that it has started."""
        for server in psutil.Process(self.process.process.pid).children(recursive=True):
            with contextlib.suppress(psutil.NoSuchProcess):
                if "jupyterhub.singleuser" in server.cmdline() and server.cwd() == str(self.homes / name):
                    return [server, *server.children(recursive=True)]
        return []

    def editor(self, name: str) -> psutil.Process:
        """Return the process of a user's editor. Raises ValueError if there is none, or several."""
        (found,) = (each for each in self.processes(name) if _is_editor(each))
        return found


def _is_editor(process: psutil.Process) -> bool:
    try:
        words: list[str] = process.cmdline()
    except psutil.NoSuchProcess:
        return False
    return words[2:5] == ["-m", "visualhfsm", "edit"]


def _settings_of_the_page() -> str:
    """Return what a school adds to the configuration of its hub."""
    blocks = blocks_of((DOCS / "how-to/classroom.md").read_text("utf-8"))
    return "".join(block.text for block in blocks if block.language == "python")


@contextlib.contextmanager
def jupyter_hub(folder: Path, *, cameras: bool = False) -> Iterator[Hub]:
    """Start a hub with everything that it keeps in a folder; without the programs for it, skip the test.

    Setting up the `cameras` of simulations takes most of their start.
    """
    for package in ("jupyterhub", "jupyter_server_proxy"):
        if find_spec(package) is None:
            pytest.skip(f"needs the package {package}: pip install jupyterhub 'visualhfsm[jupyter]'")
    if not _PROXY.exists() or shutil.which("node") is None:
        pytest.skip("needs configurable-http-proxy: make hub, where Node.js is installed")
    homes = folder / "homes"
    homes.mkdir()
    port = free_port()
    without = folder / "without"
    without.mkdir()
    (without / f"{_WITHOUT}.py").write_text('raise ImportError("left out")\n')
    python_path = os.pathsep.join((str(without), str(ROOT)))
    environment = {  # the hub passes on little else
        **({} if cameras else {"MUJOCO_GL": "disable"}),
        "PYTHONPATH": python_path,
        "TMPDIR": os.environ.get("TMPDIR", "/tmp"),
        "VISUALHFSM_TIMEOUT": str(CALL_LIMIT),
    }
    config = _CONFIG.format(
        port=port,
        hub_port=free_port(),
        proxy_port=free_port(),
        proxy=str(_PROXY),
        homes=str(homes),
        python=sys.executable,
        patience=int(SERVER_LIMIT),
        environment=environment,
        secret=_SECRET,
    )
    (folder / "jupyterhub_config.py").write_text(config + _settings_of_the_page())
    command = module("jupyterhub", "-f", "jupyterhub_config.py")
    process = ComponentProcess(command, {"PYTHONPATH": python_path}, cwd=folder)
    with process:
        process.wait_for("JupyterHub is now running", SERVER_LIMIT)
        yield Hub(process, f"http://127.0.0.1:{port}", homes)
