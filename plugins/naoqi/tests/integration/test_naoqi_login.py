"""A robot over TLS with a login, as NAOqi 2.9 requires."""

import select
import shutil
import socket
import ssl
import subprocess
import threading
from contextlib import closing, contextmanager, suppress

import pytest

pytest.importorskip("qi", reason="a real robot needs libqi: pip install 'visualhfsm[naoqi]'")

from naoserver.hardware.connection import LinkLost
from plugins.naoqi.tests.support.naoqi import call
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, RUN_LIMIT
from tests.support.processes import ComponentProcess, module
from visualhfsm_naoqi.robot._libqi_link import connect
from visualhfsm_naoqi.robot._link import RobotAddress

pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl makes the certificate")

BUFFER = 1 << 16


@pytest.fixture(scope="module")
def certificate(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tls")
    key, certificate = folder / "key.pem", folder / "certificate.pem"
    command = (
        "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 1 -subj /CN=nao"
    )
    subprocess.run(
        [*command.split(), "-keyout", key, "-out", certificate],
        check=True,
        capture_output=True,
        timeout=RUN_LIMIT,
    )
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)
    return context


@pytest.fixture(scope="module")
def port():
    """The port of a robot that talks without TLS: libqi for Python cannot listen with it."""
    with ComponentProcess(module("visualhfsm_naoqi.programs", "--qi", "tcp://127.0.0.1:0")) as process:
        yield int(process.wait_for(r"^ready: \S+:(\d+)")[1])


@contextmanager
def unwrapped(context, port):
    """Take TLS off one connection and pass it on; yield where to connect to."""
    with socket.create_server(("127.0.0.1", 0)) as door:
        ending = threading.Event()
        relay = threading.Thread(target=pass_on, args=(door, context, port, ending))
        relay.start()
        try:
            yield RobotAddress.parse(f"tcps://127.0.0.1:{door.getsockname()[1]}", "nao", "secret")
        finally:
            ending.set()
            with suppress(OSError):
                door.shutdown(socket.SHUT_RDWR)
            relay.join(EVENT_LIMIT)


def pass_on(door, context, port, ending):
    with (
        suppress(OSError),
        door.accept()[0] as plain,
        context.wrap_socket(plain, server_side=True) as client,
        socket.create_connection(("127.0.0.1", port)) as robot,
    ):
        while not ending.is_set():
            ready = [client] if client.pending() else select.select([client, robot], [], [], 0.05)[0]
            for end in ready:
                data = end.recv(BUFFER)
                if not data:
                    return
                (robot if end is client else client).sendall(data)


def test_calls_go_over_tls_with_a_login(certificate, port):
    with unwrapped(certificate, port) as address, closing(connect(address, CALL_LIMIT)) as link:
        assert len(call(link, "ALMotion.getAngles", "Body", True)) == 26
        call(link, "ALMotion.setAngles", "HeadYaw", 0.2, 1.0)


def test_a_robot_that_wants_tls_is_not_reached_without(certificate, port):
    with unwrapped(certificate, port) as address, pytest.raises(LinkLost, match="cannot connect"):
        connect(RobotAddress.parse(f"tcp://{address.host}:{address.port}"), CALL_LIMIT)
