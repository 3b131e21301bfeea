"""How the browser caches the page's files."""

from __future__ import annotations

import asyncio
import base64
import gzip
import hashlib
import json
import re
from pathlib import Path

import pytest
from starlette.exceptions import HTTPException
from starlette.requests import Request

from tests.support.places import ROOT
from visualhfsm._base.html_file import STATIC
from visualhfsm._editor.assets import Assets, without_comments
from visualhfsm._processes.bodies import find_bodies

PAGE = '<script type="importmap">%IMPORT_MAP%</script>\n%PRELOADS%\n<script src="./static/%VERSION%/shell/app.js"></script>'
LIGHT = 150_000
"""The most bytes that the page, its styles and first modules may have, compressed as they are sent."""


@pytest.fixture
def static(tmp_path: Path) -> Path:
    for folder in ("canvas", "shell", "vendor"):
        (tmp_path / folder).mkdir()
    (tmp_path / "index.html").write_text(PAGE)
    (tmp_path / "shell" / "app.js").write_text(
        'import { html } from "lit";\nimport {\n  Canvas,\n} from "../canvas/canvas.js";\nimport "../keys.js";\n'
        'const later = () => import("../monitor.js");\n'
    )
    (tmp_path / "canvas" / "canvas.js").write_text(
        'export * from \'../geometry.js\';\nexport { store } from "../shell/app.js";\nexport const from = "./nothing.js";\n'
    )
    for name in ("geometry.js", "keys.js", "monitor.js", "vendor/lit.js"):
        (tmp_path / name).write_text("export {};\n")
    return tmp_path


def version(assets: Assets) -> str:
    found = re.search(rb"\./static/([0-9a-f]{12})/shell/app\.js", assets.page().html)
    assert found
    return found[1].decode()


def sent(assets: Assets, name: str, **view: str) -> bytes:
    """A file as a browser receives it, compressed."""
    scope = {
        "type": "http",
        "headers": [(b"accept-encoding", b"gzip")],
        "path_params": {"version": version(assets), "path": name, **view},
    }
    answer = asyncio.run(assets.file(Request(scope)))
    assert answer.headers["content-encoding"] == "gzip"
    return bytes(answer.body)


def test_the_page_asks_at_once_for_all_modules_that_it_begins_with(static: Path) -> None:
    assets = Assets(static)
    base = f"./static/{version(assets)}/"
    preloaded = re.findall(r'modulepreload" href="([^"]+)"', assets.page().html.decode())
    names = ["canvas/canvas.js", "geometry.js", "keys.js", "shell/app.js", "vendor/lit.js"]
    assert sorted(preloaded) == [base + name for name in names]


def test_the_modules_of_a_view_are_served_below_its_name_and_import_those_of_the_page(
    static: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("view")
    (folder / "view.js").write_text("// Chess\nimport 'visualhfsm/keys.js';\n")
    (static / "index.html").write_text(f"{PAGE}%VIEWS%")
    assets, other = Assets(static, {"chess": folder}), version(Assets(static))
    number = version(assets)
    html = assets.page().html.decode()
    assert f'<script type="module" src="./plugins/chess/{number}/view.js"></script>' in html
    assert f'modulepreload" href="./plugins/chess/{number}/view.js"' in html
    assert f'"visualhfsm/":"./static/{number}/"' in html
    assert (
        gzip.decompress(sent(assets, "view.js", view="chess")) == b"        \nimport 'visualhfsm/keys.js';\n"
    )
    assert number != other
    for view, name in (("chess", "../index.html"), ("chess", "keys.js"), ("go", "view.js")):
        with pytest.raises(HTTPException):
            sent(assets, name, view=view)


def test_the_hash_is_that_of_the_import_map(static: Path) -> None:
    page = Assets(static).page()
    found = re.search(rb'importmap">(.*?)</script>', page.html)
    assert found
    assert page.script_hash == "sha256-" + base64.b64encode(hashlib.sha256(found[1]).digest()).decode()
    assert json.loads(found[1])["imports"]["lit"].endswith("/vendor/lit.js")


def test_the_version_changes_with_any_file_and_with_nothing_else(static: Path) -> None:
    assets = Assets(static)
    first = version(assets)
    assert version(assets) == version(Assets(static)) == first
    (static / "monitor.js").write_text("export const changed = true;\n")
    second = version(assets)
    assert second != first
    (static / "monitor.js").rename(static / "monitoring.js")
    assert version(assets) not in {first, second}


def test_all_that_the_real_page_asks_for_is_there() -> None:
    html = Assets().page().html.decode()
    wanted = re.findall(r'"\./static/[0-9a-f]{12}/([^"]+)"', html)
    assert "vendor/lit.js" in wanted
    assert not [name for name in wanted if not (STATIC / name).is_file()]
    assert "%" not in html.replace("%NONCE%", "")


@pytest.mark.slow
def test_what_the_page_loads_before_the_first_need_stays_light() -> None:
    assets = Assets()
    html = assets.page().html
    loaded = set(re.findall(r'(?:href|src)="\./static/[0-9a-f]{12}/([^"]+)"', html.decode()))
    assert {"shell/app.js", "kit/unexpected.js", "vendor/lit.js", "styles/theme.css"} <= loaded
    sizes = {name: len(sent(assets, name)) for name in loaded}
    total = sum(sizes.values()) + len(gzip.compress(html, 6))
    heaviest = sorted(sizes.items(), key=lambda item: -item[1])[:10]
    assert total < LIGHT, f"{total} bytes, compressed; the heaviest: {heaviest}"


def test_each_robot_that_is_installed_has_a_small_picture(tmp_path: Path) -> None:
    sizes = {body.name: len(sent_whole(f"pictures/{body.name}.webp")) for body in find_bodies(tmp_path)}
    assert len(sizes) >= 5
    assert max(sizes.values()) < 6_000, sizes


def sent_whole(name: str) -> bytes:
    """A picture as a browser receives it."""
    assets = Assets()
    scope = {"type": "http", "headers": [], "path_params": {"version": version(assets), "path": name}}
    answer = asyncio.run(assets.file(Request(scope)))
    assert answer.headers["content-type"] == "image/webp"
    return bytes(answer.body)


def test_style_sheets_are_sent_without_their_comments(static: Path) -> None:
    (static / "theme.css").write_text(":root { /* of all */ --ink: #fff; }\n/* a\n b */\np { color: red; }\n")
    assert gzip.decompress(sent(Assets(static), "theme.css")) == (
        b":root {  --ink: #fff; }\n\n\np { color: red; }\n"
    )


def test_modules_are_sent_without_their_comments(static: Path) -> None:
    (static / "keys.js").write_text("/**\n * Keys of an editor.\n */\n\nexport const first = 1; // kept\n")
    assert gzip.decompress(sent(Assets(static), "keys.js")) == (
        b"   \n                     \n   \n\nexport const first = 1; // kept\n"
    )


@pytest.mark.parametrize(
    ("module", "rest"),
    [
        ("  // one line\nf();", "             \nf();"),
        ("/** @type {A} */\nlet a;", "                \nlet a;"),
        ("/* one */ /* two */\nf();", "/* one */ /* two */\nf();"),  # left alone, as it is rare
        ("const a = /** @type {A} */ (b);", "const a = /** @type {A} */ (b);"),
        ("/** @type {A} */ (b).c();", "/** @type {A} */ (b).c();"),
        ('const url = "https://here"; // why', 'const url = "https://here"; // why'),
        ("/* /* // */\nf();", "           \nf();"),
        ("// /*\nf();\n// */", "     \nf();\n     "),
        ("/* ä */", "       "),
    ],
)
def test_comments_give_way_to_spaces_and_code_stays_where_it_is(module: str, rest: str) -> None:
    assert without_comments(module) == rest


def test_libraries_are_sent_as_they_are(static: Path) -> None:
    (static / "vendor" / "lit.js").write_text("/* BSD-3-Clause */\nexport {};\n")
    assert gzip.decompress(sent(Assets(static), "vendor/lit.js")) == b"/* BSD-3-Clause */\nexport {};\n"


def test_bundles_are_modules_without_source_maps_and_with_their_licences() -> None:
    licences = (STATIC / "vendor" / "LICENSES.txt").read_text()
    for package in (
        "lit 3.3.3 (BSD-3-Clause)",
        "codemirror 6.0.2 (MIT)",
        "three 0.187.0 (MIT)",
        "uplot 1.6.32 (MIT)",
    ):
        assert package in licences
    for bundle in (STATIC / "vendor").glob("*.js"):
        text = bundle.read_text("utf-8")
        assert "export{" in text
        assert "sourceMappingURL" not in text


VENDOR = STATIC / "vendor"
REPORT = json.loads((VENDOR / "packages.json").read_text("utf-8"))
"""What is vendored, as tools/vendor/build.mjs reports it; the SBOM of a release has it, too."""


def test_the_report_has_every_vendored_file_with_its_hash() -> None:
    files = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in VENDOR.iterdir()}
    for own in ("LICENSES.txt", "packages.json"):
        del files[own]
    assert {name: bundle["sha256"] for name, bundle in REPORT["bundles"].items()} == files


def test_the_report_names_the_packages_of_the_lock_file() -> None:
    lock = json.loads((ROOT / "tools" / "vendor" / "package-lock.json").read_text("utf-8"))["packages"]
    bundled = {name for bundle in REPORT["bundles"].values() for name in bundle["packages"]}
    assert bundled == set(REPORT["packages"])
    for name, package in REPORT["packages"].items():
        locked = lock[f"node_modules/{name}"]
        assert package == {key: locked[key] for key in ("version", "license", "integrity")}


def test_the_licence_of_every_vendored_package_is_there() -> None:
    sections = (VENDOR / "LICENSES.txt").read_text("utf-8").partition("\n\n")[2].split(f"\n{'-' * 100}\n\n")
    texts = {title: text for title, _, text in (section.partition("\n\n") for section in sections)}
    assert set(texts) == {
        f"{name} {package['version']} ({package['license']})" for name, package in REPORT["packages"].items()
    }
    assert [title for title, text in texts.items() if "copyright" not in text.lower()] == []
