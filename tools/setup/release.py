"""Build the distributions of a release and check them: `make release` writes dist/, and uploads nothing.

The core and all plug-ins are released together, with one version. CHANGELOG.md has a section with it and its
date.
"""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import threading
import urllib.request
import zipfile
from pathlib import Path
from typing import Final

from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

from tools.workspace import CORE, DISTRIBUTIONS, ROOT, Distribution

DIST: Final = ROOT / "dist"
TOGETHER: Final = (
    *("agent", "booster", "classes", "cluster", "jupyter", "learning", "match", "models", "naoqi", "python2"),
    *("ros2", "security", "sim", "test", "trials", "vision", "web"),
)
"""All extras of users."""
VENDORED: Final = "visualhfsm/_editor/static/vendor/packages.json"
PROJECT: Final = CORE.settings
LIMIT: Final = 600  # s for a step
PLACES: Final = ("e", "Zoë Müller", "it's/a/deep folder")
"""Where the wheel is installed, too: what grading hides from submissions has another order there."""


STRANGER: Final = """import glob
there = [path for path in glob.glob("/packages/site*/visualhfsm*/*") if ".dist-info" not in path]
raise ValueError(f"sees {there}")"""
"""What a submission begins with: its walls cover our packages among those that are installed.

What says that they are there, and names their entry points, is seen: formats of documents are found by it.
"""


class ReleaseError(Exception):
    """The release is not in order."""


def run(*command: str | Path, cwd: Path = ROOT) -> str:
    """Return the output of a command; raises ReleaseError, with the output, when it fails."""
    constraints = str(ROOT / "constraints.txt")
    environment = {**os.environ, "PIP_CONSTRAINT": constraints, "UV_CONSTRAINT": constraints}
    environment.pop("PYTHONPATH", None)
    done = subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=LIMIT, check=False
    )
    if done.returncode:
        raise ReleaseError(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def dated(version: str) -> str:
    """Return the heading of a version in CHANGELOG.md; one under development has none yet."""
    if ".dev" in version:
        return f"{version}, unreleased"
    changelog = (ROOT / "CHANGELOG.md").read_text("utf-8")
    found = re.search(rf"^## {re.escape(version)} - \d{{4}}-\d\d-\d\d$", changelog, re.MULTILINE)
    if found is None:
        raise ReleaseError(
            f"CHANGELOG.md has no section {version!r} with a date: write one, or change pyproject.toml"
        )
    return found[0].removeprefix("## ")


def missing(names: set[str], wanted: list[str]) -> None:
    """Raise ReleaseError when a distribution lacks files."""
    if absent := [name for name in wanted if name not in names]:
        raise ReleaseError(f"the distribution lacks {', '.join(absent)}")


def build(distribution: Distribution) -> Path:
    """Build a wheel, and of the core the sources, too, which are the whole repository; return the wheel."""
    kind = [] if distribution is CORE else ["--wheel"]
    run(sys.executable, "-m", "build", *kind, "--outdir", DIST, distribution.folder)
    name = distribution.project["name"].replace("-", "_")
    return DIST / f"{name}-{distribution.project['version']}-py3-none-any.whl"


def check_contents(distribution: Distribution, wheel: Path) -> None:
    """Compare a wheel with the files of its packages and of what else it ships."""
    tracked = run("git", "ls-files").splitlines()
    places = {path: path.name for path in distribution.packages} | distribution.shipped
    wanted = []
    for path, place in places.items():
        folder = path.relative_to(ROOT).as_posix()
        wanted += [place] if path.is_file() else []
        wanted += [
            f"{place}/{name.removeprefix(f'{folder}/')}" for name in tracked if name.startswith(f"{folder}/")
        ]
    licences = f"{'-'.join(wheel.name.split('-')[:2])}.dist-info/licenses"
    wanted += [f"{licences}/{name}" for name in distribution.project.get("license-files", ())]
    with zipfile.ZipFile(wheel) as archive:
        missing(set(archive.namelist()), wanted)


def check_sources(sdist: Path) -> None:
    """Compare the source distribution with the files of the repository: it has all of them."""
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    missing(names, run("git", "ls-files").splitlines())


def install(folder: Path, *what: str) -> Path:
    """Make an environment with some of the distributions and what they require; return its Python."""
    run(sys.executable, "-m", "venv", "--without-pip", folder)
    python = folder / "bin" / "python"
    uv = Path(sys.executable).with_name("uv")
    # It keeps wheels by name and version, and ours are often built anew.
    new = [f"--refresh-package={each.project['name']}" for each in DISTRIBUTIONS]
    places = ["--python", str(python), "--find-links", str(DIST)]
    run(uv, "pip", "install", "--quiet", "--system-certs", *new, *places, *what)
    return python


def check_alone(distribution: Distribution, wheel: Path, folder: Path) -> None:
    """Install one wheel with the core alone, import its packages, and let commands list what it adds."""
    python = install(folder, str(wheel))
    for package in distribution.packages:
        run(python, "-c", f"import {package.name}", cwd=folder)
    run(python.with_name("visualhfsm"), "--help", cwd=folder)
    for name in distribution.project.get("scripts", ()):
        run(python.with_name(name), "--help", cwd=folder)


def check_commands(programs: Path, folder: Path) -> None:
    """Run the commands of the installed wheel: help, `codegen`, `check`, `new`, the editor, and `grade`."""
    for name in PROJECT["project"]["scripts"]:
        run(programs / name, "--help", cwd=folder)
    shutil.copytree(ROOT / "behaviors", folder / "behaviors", ignore=shutil.ignore_patterns("*.py", "__*"))
    document = folder / "behaviors" / "dance.xml"
    run(programs / "codegen", document, cwd=folder)
    run(programs / "visualhfsm", "check", document, cwd=folder)
    run(programs / "python", document.with_suffix(".py"), "--help", cwd=folder)
    run(programs / "visualhfsm", "new", "my-robot", cwd=folder)
    run(programs / "python", "behaviors/blinker.py", "--help", cwd=folder / "my-robot")
    check_editor(programs, folder / "empty")
    for exercise in sorted((ROOT / "exercises").iterdir()):
        if exercise.is_dir():
            run(programs / "visualhfsm", "grade", exercise.name, "--check", cwd=folder)


def check_editor(programs: Path, folder: Path) -> None:
    """Open the page of `visualhfsm edit` in an empty folder, and each of its modules."""
    folder.mkdir()
    command = [str(programs / "visualhfsm"), "edit", "--no-browser"]
    with subprocess.Popen(
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as editor:
        limit = threading.Timer(LIMIT, editor.kill)
        limit.start()
        try:
            assert editor.stdout is not None
            address = next(
                (found[0] for line in editor.stdout if (found := re.search(r"http://127\S+", line))), None
            )
            if address is None:
                raise ReleaseError("visualhfsm edit ended without printing its address")
            opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
            page = opener.open(address, timeout=60).read().decode()
            base = address.partition("/?")[0]
            modules = set(re.findall(r'"\.(/static/[^"]+\.\w+)"', page))
            for module in modules:
                opener.open(base + module, timeout=60).read()
        finally:
            editor.terminate()
            editor.wait()
            limit.cancel()
    if len(modules) < 20:
        raise ReleaseError(f"the page names {len(modules)} files, not its modules")


def check_places(wheels: list[Path], python: Path, folder: Path) -> None:
    """Grade a document that looks for the solutions, for each exercise, where other folders have the wheels.

    The packages that it needs are those of the environment of `python`.
    """
    site = "import sysconfig; print(sysconfig.get_path('purelib'))"
    packages = run(python, "-c", site)
    documents = {
        each.parent.parent.name: each for each in sorted((ROOT / "exercises").glob("*/solution/solution.xml"))
    }
    for name, document in documents.items():
        (folder / name).mkdir(parents=True)
        text = document.read_text("utf-8").replace("<code>", f"<code>{STRANGER}\n", 1)
        (folder / name / "one.xml").write_text(text, "utf-8")
    for place in PLACES:
        there = install(folder / place, "--no-deps", *map(str, wheels))
        Path(run(there, "-c", site).strip(), "packages.pth").write_text(packages, "utf-8")
        for name in documents:
            run(there, "-m", "visualhfsm", "grade", name, folder / name, cwd=folder)
            marks = "".join(path.read_text("utf-8") for path in (folder / "marks").glob("*.csv"))
            if "sees []" not in marks:
                raise ReleaseError(f"a submission to {name} sees what is installed in {place}: {marks}")
            shutil.rmtree(folder / "marks")


def write_sbom(python: Path, path: Path) -> None:
    """Write the packages of an environment and the vendored libraries as an SBOM of CycloneDX.

    It has no addresses: those of the environment belong to this machine. Build tools are left out.
    """
    tool = Path(sys.executable).with_name("cyclonedx-py")
    options = ["--pyproject", str(ROOT / "pyproject.toml"), "--output-reproducible", "--spec-version", "1.6"]
    bom = json.loads(run(tool, "environment", *options, python))
    for component in [bom["metadata"]["component"], *bom["components"]]:
        component.pop("externalReferences", None)
        component.pop("properties", None)
    for tools in bom["metadata"].get("tools", {}).values():
        for each in tools:
            each.pop("externalReferences", None)
    bom["components"] = [each for each in bom["components"] if each["name"] not in {"pip", "setuptools"}]
    root = bom["metadata"]["component"]["bom-ref"]
    needed = next(each for each in bom["dependencies"] if each["ref"] == root)["dependsOn"]
    for name, package in json.loads((ROOT / VENDORED).read_text("utf-8"))["packages"].items():
        purl = f"pkg:npm/{name.replace('@', '%40')}@{package['version']}"
        content = base64.b64decode(package["integrity"].removeprefix("sha512-")).hex()
        bom["components"].append(
            {
                "type": "library",
                "bom-ref": purl,
                "name": name,
                "version": package["version"],
                "purl": purl,
                "licenses": [{"license": {"id": package["license"]}}],
                "hashes": [{"alg": "SHA-512", "content": content}],
            }
        )
        needed.append(purl)
    kept = {root, *(each["bom-ref"] for each in bom["components"])}
    bom["dependencies"] = [each for each in bom["dependencies"] if each["ref"] in kept]
    text = json.dumps(bom, indent=2) + "\n"
    if (error := JsonStrictValidator(SchemaVersion.V1_6).validate_str(text)) is not None:
        raise ReleaseError(f"the SBOM is no CycloneDX: {error}")
    path.write_text(text, "utf-8")


def main() -> None:
    """Build, check, and leave the distributions and the SBOM in dist/."""
    version = PROJECT["project"]["version"]
    heading = dated(version)
    shutil.rmtree(DIST, ignore_errors=True)
    print(f"building visualhfsm {heading}")
    wheels = {each.project["name"]: build(each) for each in DISTRIBUTIONS}
    sdist = DIST / f"visualhfsm-{version}.tar.gz"
    run(sys.executable, "-m", "twine", "check", "--strict", sdist, *wheels.values())
    check_sources(sdist)
    for each in DISTRIBUTIONS:
        check_contents(each, wheels[each.project["name"]])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for each in DISTRIBUTIONS:
            print(f"installing {each.project['name']} alone")
            check_alone(each, wheels[each.project["name"]], folder / each.project["name"])
        print("installing all together, and running their commands")
        python = install(folder / "venv", f"{wheels['visualhfsm']}[{','.join(TOGETHER)}]")
        check_commands(python.parent, folder)
        check_places([*wheels.values()], python, folder / "places")
        write_sbom(python, DIST / f"visualhfsm-{version}.cdx.json")
    print("\n".join(f"dist/{path.name}: {path.stat().st_size // 1000} kB" for path in sorted(DIST.iterdir())))


if __name__ == "__main__":
    try:
        main()
    except ReleaseError as error:
        sys.exit(f"error: {error}")
