"""Paths and names under which browsers find the page."""

from __future__ import annotations

import pytest
from starlette.types import Scope

from visualhfsm._editor.site import BasePathError, Site, base_path


def request(path: str, kind: str = "http", **headers: str) -> Scope:
    """Return a request as the server reads it; `x_forwarded_host` stands for X-Forwarded-Host."""
    named = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]
    return {"type": kind, "path": path, "scheme": {"http": "http"}.get(kind, "ws"), "headers": named}


def host_of(scope: Scope) -> list[bytes]:
    return [value for name, value in scope["headers"] if name == b"host"]


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("", "/"),
        ("/", "/"),
        ("robots", "/robots/"),
        ("/user/ana/visualhfsm", "/user/ana/visualhfsm/"),
        ("/user/ana@school.example/visualhfsm/", "/user/ana@school.example/visualhfsm/"),
        ("/user/jos%C3%A9/visualhfsm/", "/user/jos%C3%A9/visualhfsm/"),
        ("/statics/", "/statics/"),
    ],
)
def test_a_path_gets_a_slash_at_both_ends(given: str, meant: str) -> None:
    assert base_path(given) == meant


@pytest.mark.parametrize(
    "path",
    [
        "/user//ana/",
        "/user/josé/",
        "/a b/",
        "/a;path=/",
        "/a\r\nset-cookie: x/",
        "/a?b/",
        "/a#b/",
        "/%zz/",
        "http://robots.example/a/",
        "/a/../b/",
        "/a/%2e%2E/b/",
        "/./",
        "/static/",
        "/ws",
        "/%77s/",
        "/camera/ana/",
        "/" + 600 * "a/",
    ],
)
def test_a_path_that_browsers_or_the_page_would_misunderstand_is_refused(path: str) -> None:
    with pytest.raises(BasePathError, match="the page cannot be served below"):
        Site(path)


@pytest.mark.parametrize(
    ("asked", "within"),
    [
        ("/user/josé/robots/", "/"),
        ("/user/josé/robots/static/1/app.js", "/static/1/app.js"),
        ("/user/josé/robots/ws", "/ws"),
        ("/", "/"),
        ("/static/1/app.js", "/static/1/app.js"),
        ("/ws", "/ws"),
        ("/user/josé/robots", ""),
        ("/user/josé/robotsx/ws", "/user/josé/robotsx/ws"),
        ("/user/ben/robots/ws", "/user/ben/robots/ws"),
    ],
)
def test_the_proxy_may_take_the_path_off_or_pass_it_on(asked: str, within: str) -> None:
    assert Site("/user/jos%C3%A9/robots/").as_asked(request(asked))["path"] == within


def test_without_a_path_nothing_is_taken_off() -> None:
    for path in ("/", "/ws", "/static/1/app.js", "//"):
        assert Site().as_asked(request(path))["path"] == path


def test_what_a_request_says_of_a_proxy_counts_only_when_that_is_trusted() -> None:
    asked = request("/", host="127.0.0.1:1", x_forwarded_host="robots.example", x_forwarded_proto="https")
    unchanged = Site().as_asked(asked)
    assert (host_of(unchanged), unchanged["scheme"]) == ([b"127.0.0.1:1"], "http")
    believed = Site(trusts_proxy=True).as_asked(asked)
    assert (host_of(believed), believed["scheme"]) == ([b"robots.example"], "https")


def test_of_several_proxies_the_nearest_counts() -> None:
    asked = request(
        "/", host="a", x_forwarded_host="evil.example, robots.example", x_forwarded_proto="ftp,https"
    )
    believed = Site(trusts_proxy=True).as_asked(asked)
    assert (host_of(believed), believed["scheme"]) == ([b"robots.example"], "https")


def test_a_websocket_of_a_secure_page_is_secure() -> None:
    asked = request("/ws", "websocket", host="a", x_forwarded_proto="https")
    assert Site(trusts_proxy=True).as_asked(asked)["scheme"] == "wss"


def test_a_trusted_proxy_need_not_say_anything() -> None:
    asked = request("/", host="127.0.0.1:1", x_forwarded_proto="gopher")
    believed = Site(trusts_proxy=True).as_asked(asked)
    assert (host_of(believed), believed["scheme"]) == ([b"127.0.0.1:1"], "http")


@pytest.mark.parametrize("host", ["localhost", "[::1]:80", "127.0.0.9", "Robots.example:443"])
def test_names_of_loopback_and_those_allowed_are_ours(host: str) -> None:
    assert Site(hosts=["robots.EXAMPLE"]).is_ours(host)


@pytest.mark.parametrize("host", ["", "evil.example", "robots.example.evil", "robots.example; x", "10.0.0.1"])
def test_other_names_are_not(host: str) -> None:
    assert not Site(hosts=["robots.example"]).is_ours(host)


def test_any_name_is_ours_where_a_proxy_checks_who_comes_if_it_is_one() -> None:
    assert Site(hosts=None).is_ours("hub.school.example:443")
    assert not Site(hosts=None).is_ours("hub.example; script-src *")
