"""A body made of a model: of it alone, or of a TOML file that names its parts.

    model = "my_robot.urdf"             # beside this file; MJCF, URDF or xacro
    name = "MyRobot"

    [groups]                            # the joints of each limb, from the trunk outwards
    head = ["pan", "tilt"]

    [hinges.Neck]                       # served as NeckMotors, NeckEncoders, NeckSpeed and Head
    pan = "pan"
    tilt = { joint = "tilt", sign = -1 }

    [[cameras]]
    name = "Camera"
    link = "head"
    horizontal_fov = 1.05

Everything that a facts file describes (`naoserver.body`) may be given; links, joints, contact shapes and
looks come from the model. `[joint.NAME]` corrects what the model says of a joint, `[servo.NAME]` gives some
joints their gains. Of a model alone, this file is guessed: `write_own_body` writes it to be edited.
"""

from __future__ import annotations

import copy
import logging
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from naoserver.bodies.description import write_looks
from naoserver.body import LARGEST_DESCRIPTION, Body, write_body
from naoserver.errors import RobotError
from naoserver_sim.model import WIDEST_IMAGE, is_simulated
from naoserver_sim.named_body import named_body
from visualhfsm_own_robots._guesses import Guesser, Guesses, guess_overlaps
from visualhfsm_own_robots._looks import looks_in
from visualhfsm_own_robots._model_file import ModelFile, give_back_memory, read_model
from visualhfsm_own_robots._parts import OwnFile, fit_name, parts_of
from visualhfsm_own_robots._toml_text import toml_text, torques_to_paste
from zenoh_ice.data.text import printable
from zenoh_ice.data.toml_file import convert, parse_toml, place, read_text

_THICKNESS: Final = 0.01
"""Half thickness in m of the box on which a foot stands."""
_CAMERA: Final = {
    "sizes": [[320, 240], [640, 480]],
    "rates": [30.0, 30.0],
    "position": [0, 0, 0],
    "tilt": 0.0,
}
_FROM_THE_MODEL: Final = {"links", "joints", "fixed_joints", "gears", "shapes", "looks"}
_MOST_REPORTED: Final = 5
"""Notes about the model that are logged, at most."""
_MOST_SAID: Final = 12
"""Lines about the guesses, at most."""
_HEAD: Final = """\
This is what {model} was taken for, each guess with its reason beside it. Correct what is wrong, and delete \
what the robot does not have. docs/reference/bodies.md describes all keys. To serve the robot:

    naoserver-sim --body {file}
"""

_NONE: Final[Mapping[str, str]] = {}

_log = logging.getLogger(__name__)


def read_own_body(
    path: Path,
    text: str | None = None,
    *,
    arguments: Mapping[str, str] = _NONE,
    say: Callable[[str], None] = _log.info,
) -> Body:
    """Return the body that a file describes: a model alone, or TOML beside its model.

    `text` is what the file is to have, if not what it has; `arguments` are those of a model in xacro, besides
    what a TOML file says of them. What a model alone was taken for is reported to `say`, in some ten lines;
    what is not kept of a model is logged. Raises RobotError with file, line and name when files cannot be
    read or do not fit together.
    """
    if path.suffix.lower() != ".toml":
        return _said(*_guessed(path, path.name, arguments), say)
    text = read_text(path, RobotError) if text is None else text
    own = parse_toml(text, OwnFile, str(path), RobotError)
    for key, name in (("model", own.model), ("meshes", own.meshes)):
        with suppress(OSError, RuntimeError, ValueError):  # no name of a file, or a circle of links
            if (path.parent / name).resolve().is_relative_to(path.parent.resolve()):
                continue
        at = place(str(path), text, key)
        raise RobotError(f"{at} = {name!r}: it must be in the folder of this file, or in one below it")
    files, given = (path.parent / own.model, path.parent / own.meshes), {**own.xacro, **arguments}
    model = read_model(*files, balance=own.balance, arguments=given)
    document = {"name": _name(path)} | tomllib.loads(text)
    return _dressed(_Description(document, model, str(path), text))


def write_own_body(
    source: Path,
    target: Path,
    *,
    arguments: Mapping[str, str] = _NONE,
    force: bool = False,
    say: Callable[[str], None] = _log.info,
) -> None:
    """Write the body of a file: as TOML to edit, each guess with its reason, or as facts in JSON to serve.

    What a model alone was taken for is reported to `say`. Raises RobotError when `source` cannot be read, or
    not be guessed from, and when `target` has another ending, exists without `force`, or is not in the folder
    of the model or one above.
    """
    kind = target.suffix.lower()
    if kind not in (".toml", ".json"):
        raise RobotError(f"{target}: a body is written as .toml or .json")
    if target.exists() and not force:
        raise RobotError(f"{target} exists: --force overwrites it")
    if kind == ".json":
        text = write_body(named_body(source, arguments=arguments, say=say)) + "\n"
    elif source.suffix.lower() in (".toml", ".json"):
        raise RobotError(
            f"{source}: a TOML file is written of a model alone: what {source.name} says is no guess"
        )
    else:
        model, folder = source.resolve(), target.parent.resolve()
        if not model.is_relative_to(folder):
            raise RobotError(
                f"{target}: write it to the folder of {source.name}, or to one above: it names the model"
            )
        name = model.relative_to(folder).as_posix()
        found, description = _guessed(source, name, arguments)
        _said(found, description, say)
        text = toml_text(found.document, found.reasons, _HEAD.format(model=source.name, file=target.name))
    try:
        target.write_bytes(text.encode())
    except (OSError, UnicodeEncodeError) as problem:  # a name that is no text
        raise RobotError(f"{target}: cannot be written: {getattr(problem, 'strerror', problem)}") from None


class _Description:
    """A TOML file, written or guessed, with its model."""

    def __init__(self, document: Mapping[str, Any], model: ModelFile, source: str, text: str = "") -> None:
        self.source: Final = source
        self.model: Final = model
        own = convert(document, OwnFile, source, RobotError, text=text)
        # Its tables are completed below, and a guessed document is read again.
        described: dict[str, Any] = copy.deepcopy(
            {key: value for key, value in document.items() if key not in OwnFile.__struct_fields__}
        )
        if taken := sorted(_FROM_THE_MODEL & described.keys()):
            raise RobotError(
                f"{source}: {taken[0]} come from the model: correct them there, or by [joint] and [servo]"
            )
        self.parts: Final = parts_of(model, own, mounted=bool(described.get("mounted")))
        if self.parts.unsaid:
            torques = {joint["name"]: joint["max_torque"] for joint in self.parts.tables["joints"]}
            raise RobotError(_unsaid({name: torques[name] for name in self.parts.unsaid}, source))
        described["name"] = own.name
        tables, given = self.parts.tables, described.get("couplings", [])
        followers = [pair.get("follower") for pair in _tables_in(given)]
        if isinstance(given, list):
            of_model = [pair for pair in tables["couplings"] if pair["follower"] not in followers]
            described["couplings"] = of_model + given
        described = tables | described
        described["shapes"] = described["shapes"] + list(_soles(described))
        for camera in _tables_in(described.get("cameras")):
            camera |= {key: value for key, value in _CAMERA.items() if key not in camera}
        for hinge in _tables_in(described.get("hinges")):
            hinge |= {axis: {"joint": of} for axis, of in hinge.items() if isinstance(of, str)}
        self.body: Final = convert(described, Body, source, RobotError, text=text)
        if (size := len(write_body(self.body))) > LARGEST_DESCRIPTION:
            raise RobotError(
                f"{source}: its description is too large: {size} bytes, at most {LARGEST_DESCRIPTION}"
            )
        if not (self.body.shapes or self.body.mounted):
            missing = ", for its meshes are left out" if model.left_out else ""
            raise RobotError(
                f"{source}: no link of {own.name} has a shape that touches{missing}: it would fall through"
                ' the floor; name the folder of its meshes, meshes = "...", or fix it to its place,'
                " mounted = true"
            )


def _guessed(path: Path, name: str, arguments: Mapping[str, str]) -> tuple[Guesses, _Description]:
    """Return the TOML file that a model alone stands for, called `name` in it, and what it describes."""
    model = read_model(path, path.parent, arguments=arguments)
    found = Guesses({"model": name, "name": _name(path), "xacro": dict(arguments)})
    parts = parts_of(model, OwnFile(model=name), mounted=False)
    Guesser(model, parts, found).guess()
    guess_overlaps(found, parts, _Description(found.document, model, model.where).body, model.where)
    return found, _Description(found.document, model, model.where)


def _said(found: Guesses, description: _Description, say: Callable[[str], None]) -> Body:
    """Return a guessed body, after saying what was guessed."""
    body = _dressed(description, found.doubts)
    way = "mounted" if body.mounted else "free to move"
    lines = [
        f"{len(body.links)} links, {len(body.joints)} joints, {body.mass:.3g} kg, {way}",
        *found.lines(),
    ]
    if (more := len(lines) - 1 - _MOST_SAID) > 0:
        lines[1 + _MOST_SAID :] = [f"and {more} more guesses, which --write-body writes"]
    for line in lines:
        say(f"{Path(description.source).name}: {line}")
    return body


def _dressed(of: _Description, doubts: Iterable[str] = ()) -> Body:
    """Return the body with its looks, unless they are too large, after logging what its model loses."""
    left_out = [f"the mesh {printable(mesh)} is left out: {why}" for mesh, why in of.model.left_out.items()]
    notes = [
        *of.model.notes,
        *of.parts.notes,
        *_unseen(of.body, of.source),
        *(f"{of.model.where}: {note}" for note in (*left_out, *doubts)),
    ]
    if (more := len(notes) - _MOST_REPORTED) > 0:
        notes[_MOST_REPORTED:] = [f"{of.model.where}: and {more} more such notes"]
    looks = looks_in(of.model.compiled, of.parts.frames, of.body, notes.append)
    dressed = msgspec.structs.replace(of.body, looks=looks)
    if (size := len(write_looks(dressed))) > LARGEST_DESCRIPTION:
        what = f"its looks have {size} bytes, and at most {LARGEST_DESCRIPTION} are served"
        notes.append(f"{of.source} is drawn by its contact shapes: {what}")
        dressed = of.body
    for note in notes:
        _log.warning("%s", note)
    give_back_memory()
    return dressed


def _unseen(body: Body, source: str) -> Iterator[str]:
    """Yield a note on each camera some of whose pictures the simulation does not render."""
    for camera in body.cameras:
        if sizes := [f"{w}x{h}" for w, h in camera.sizes if not is_simulated(camera, (w, h))]:
            shape = "{}x{}".format(*camera.sizes[0])
            why = (
                f"only those of the shape of its first size, {shape}, are rendered, up to {WIDEST_IMAGE} wide"
            )
            yield f"{source}: {camera.name} has no pictures of {', '.join(sizes)} here: {why}"


def _name(path: Path) -> str:
    """Return the name of a body of a file: its own, as far as a body can have it."""
    return fit_name(path.stem.removesuffix(".urdf")) or "Robot"  # of robot.urdf.xacro


def _unsaid(torques: Mapping[str, float], source: str) -> str:
    """Return what is wrong when nobody says the largest torques of some joints."""
    if len(torques) == 1:
        (name,) = torques
        what = f"joint {name!r} has no largest torque: add this, which fits the mass that it carries"
    else:
        what = (
            f"{len(torques)} joints have no largest torque: add these, which fit the masses that they carry"
        )
    return f"{source}: {what}:\n{torques_to_paste(torques)}"


def _tables_in(value: Any) -> list[dict[str, Any]]:  # noqa: ANN401
    """Return the tables in a list or a table; any other value is refused when the body is made."""
    items = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return [item for item in items if isinstance(item, dict)]


def _soles(described: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the boxes on which feet stand: round the outlines of their soles."""
    for side, sole in zip(("left", "right"), _tables_in(described.get("soles")), strict=False):
        with suppress(TypeError, ValueError):  # what is no outline is refused when the body is made
            outline = np.array(sole.get("outline", [[0.0, 0.0]]), np.float64).reshape(-1, 2)
            low, high = outline.min(axis=0), outline.max(axis=0)
            size = [*((high - low) / 2).tolist(), _THICKNESS]
            middle = [*((high + low) / 2).tolist(), _THICKNESS - sole.get("height", 0.0)]
            box = {"link": sole.get("link", ""), "kind": "box", "size": size, "position": middle}
            yield box | {"name": f"{side}_sole"}
