"""Where the proxies of a document are looked for."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen._idl import compile_interfaces
from codegen.diagnostics import Diagnostics
from codegen.hfsm.known_interfaces import KnownInterface, find_interfaces, interface_directories

LAMP = "module home { interface Lamp { idempotent bool isOn(); }; };\n"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project with a folder for documents."""
    (tmp_path / "behaviors").mkdir()
    return tmp_path


def write_lamp(folder: Path, module: str = "home") -> dict[Path, str]:
    """Compile an interface in a folder; return the files, which are not written yet."""
    folder.mkdir(parents=True, exist_ok=True)
    idl = folder / "lamp.idl"
    idl.write_text(LAMP.replace("home", module))
    found = compile_interfaces([idl], [], None, diagnostics := Diagnostics())
    assert not diagnostics.has_errors
    return {file.path.resolve(): file.text for file in found.files}


def generate_lamp(folder: Path, module: str = "home") -> None:
    for path, text in write_lamp(folder, module).items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)


def lamp(project: Path, include: list[Path] | None = None) -> KnownInterface | None:
    found = find_interfaces(project / "behaviors" / "blinker.xml", include or []).find("Lamp")
    return found[0] if found else None


@pytest.mark.parametrize(
    ("folder", "package", "directory"),
    [
        ("interfaces", "interfaces.home", ""),
        ("behaviors/interfaces", "interfaces.home", "behaviors"),
        ("behaviors", "home", "behaviors"),
    ],
)
def test_the_interfaces_of_the_project_are_found(
    project: Path, folder: str, package: str, directory: str
) -> None:
    assert lamp(project) is None
    generate_lamp(project / folder)
    found = lamp(project)
    assert found is not None
    assert (found.package, found.directory) == (package, project / directory)


def test_a_package_elsewhere_is_found_in_a_directory_that_is_named(project: Path) -> None:
    generate_lamp(project / "api")
    assert lamp(project) is None
    found = lamp(project, [project / "api"])
    assert found is not None
    assert (found.package, found.directory) == ("home", project / "api")


def test_packages_of_other_programs_beside_a_document_are_left_out(project: Path) -> None:
    generate_lamp(project / "behaviors")
    (project / "behaviors" / "home" / "schema.json").unlink()
    assert lamp(project) is None
    assert lamp(project, [project / "behaviors"]) is not None


def test_ours_are_known_before_those_of_a_project(project: Path) -> None:
    text = "module nao { interface PoseHead { void nod(); }; };\n"
    (project / "interfaces").mkdir()
    (project / "interfaces" / "head.idl").write_text(text)
    for file in compile_interfaces([project / "interfaces" / "head.idl"], [], None, Diagnostics()).files:
        file.path.parent.mkdir(exist_ok=True)
        file.path.write_text(file.text)
    (found,) = find_interfaces(project / "behaviors" / "blinker.xml").find("PoseHead")
    assert found.directory is None


def test_what_is_about_to_be_written_is_known_with_its_operations(project: Path) -> None:
    files = write_lamp(project / "interfaces")
    interfaces = find_interfaces(project / "behaviors" / "blinker.xml", [], files)
    (found,) = interfaces.find("home::Lamp")
    assert set(interfaces.operations(found) or ()) == {"isOn"}
    assert not (project / "interfaces" / "home").exists()


def test_the_directories_of_a_document_are_its_own_and_that_of_its_project(project: Path) -> None:
    document = project / "behaviors" / "blinker.xml"
    assert interface_directories(document) == [project / "behaviors"]
    (project / "interfaces").mkdir()
    assert interface_directories(document) == [project / "behaviors", project]
