"""Which joints of a user's model have motors, how firm, which move together, and where links close loops.

They are read from the compiled model, as parts of a facts file (`naoserver.body`). What of the model's
equalities, tendons and actuators is not kept is named in notes, one sentence each.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np

from naoserver.bodies.parts import Coupling
from naoserver.errors import RobotError
from visualhfsm_own_robots._figure import Figure
from visualhfsm_own_robots._looks import Frame
from visualhfsm_own_robots._model_file import ModelFile

Note = Callable[[str, str], None]
"""Adds a note: the joint or body that it is about, or an empty name, and the text."""

_POINT: Final = 1e-3
"""Width in rad or m of a range in which nothing moves."""
_MOST_TENDONS: Final = 100
"""Most tendons over joints with actuators: each is compared with each other one."""
_TINY: Final = 1e-9
_ONE_AXIS: Final = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
_OF_JOINT: Final = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
_MUSCLE: Final = mujoco.mjtGain.mjGAIN_MUSCLE


class Pull(NamedTuple):
    """What moves a joint."""

    actuator: int
    lever: float = 1.0
    """Torque at the joint for each N m, or N, of the actuator behind its gear."""


class Couplings(NamedTuple):
    """How the joints of a model move."""

    couplings: tuple[Coupling, ...]
    """The joints that follow another one, each with the joint that leads it and follows none."""
    pulls: Mapping[str, tuple[Pull, ...]]
    """The pulls on each joint that has a motor; a follower has none."""
    passive: frozenset[str]
    """The joints that no actuator moves, in a model that has actuators."""
    notes: tuple[str, ...]


class Loops(NamedTuple):
    """What holds links of a model together besides joints."""

    loops: tuple[dict[str, Any], ...]
    """Tables of `loops`."""
    mounted: bool
    """True if the root is welded to the world."""
    notes: tuple[str, ...]


@dataclass
class _Chain:
    """Joints that move together."""

    leader: str
    ways: dict[str, Coupling]
    """The coupling of each joint, the leader itself included, to the leader."""
    pulls: list[Pull] = field(default_factory=list)

    def stretches(self, tendon: Mapping[str, float]) -> float:
        """Return by how much a tendon, a sum of joints, gets longer for each rad of the leader."""
        by = sum(self.ways[joint].ratio * part for joint, part in tendon.items() if joint in self.ways)
        return by if abs(by) > _TINY else 0.0


def couplings_of(model: ModelFile) -> Couplings:
    """Return how the joints of a model move.

    Joints that an equality binds, as <mimic> of a URDF does, are coupled. So are those that one tendon with
    an actuator moves: as if they yielded alike, in proportion to its coefficients. Raises
    RobotError when there are too many such tendons.
    """
    mj = model.compiled
    notes: list[str] = []
    note = _noting(notes, model, "joint")
    motors, tendons = {}, {}
    for actuator in range(mj.nactuator):
        target = int(mj.actuator_trnid[actuator, 0])
        if mj.actuator_trntype[actuator] in _OF_JOINT:
            motors[actuator] = mj.joint(target).name
        elif mj.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_TENDON:
            tendons[actuator] = _fixed(mj, target)
    if (many := sum(map(bool, tendons.values()))) > _MOST_TENDONS:
        raise RobotError(
            f"{model.where}: {many} actuators pull at tendons over joints: at most {_MOST_TENDONS} may"
        )
    chains = _chains(mj, set(motors.values()), note)
    for each in chains:
        each.pulls += [Pull(actuator) for actuator, joint in motors.items() if joint == each.leader]
    _pull(chains, {actuator: tendon for actuator, tendon in tendons.items() if tendon})
    used = {pull.actuator for each in chains for pull in each.pulls}
    if muscles := [
        mj.actuator(each).name or str(each) for each in used if mj.actuator_gaintype[each] == _MUSCLE
    ]:
        note("", f"the muscles {', '.join(sorted(muscles))} are servos here, which pull and push")
    for actuator in sorted(set(range(mj.nactuator)) - used):
        joint = motors.get(actuator, "")
        why = f"joint {joint!r} follows another one" if joint else "it acts on no joint"
        if tendons.get(actuator):
            why = "the joints of its tendon have motors"
        note(joint, f"the actuator {mj.actuator(actuator).name or actuator!r} is left out: {why}")
    for tendon in range(mj.ntendon):
        what = f"the tendon {mj.tendon(tendon).name or tendon!r}"
        if not _fixed(mj, tendon):
            note("", f"{what} is left out: it runs along sites, not over joints")
        elif mj.tendon_limited[tendon] or np.any(mj.tendon_stiffness[tendon]):
            note("", f"the limits and the spring of {what} are left out")
    passive = [joint for each in chains if mj.nu and not each.pulls for joint in each.ways]
    if passive:
        note("", f"no actuator moves {', '.join(passive)}: passive, moved by what touches them")
    couplings = tuple(way for each in chains for joint, way in each.ways.items() if joint != each.leader)
    pulls = {each.leader: tuple(each.pulls) for each in chains if each.pulls}
    return Couplings(couplings, pulls, frozenset(passive), tuple(notes))


def keep_in_range(joints: Sequence[dict[str, Any]], couplings: Iterable[Coupling], where: str) -> None:
    """Fit the tables of coupled joints to each other, in place: ranges, highest velocities and torques.

    A leader moves as far and as fast as its followers can. Raises RobotError when one can be nowhere.
    """
    tables, pairs = {table["name"]: table for table in joints}, list(couplings)
    for pair in pairs:
        leader, follower = tables[pair.leader], tables[pair.follower]
        low, high = sorted(map(pair.reversed().of, _range(follower)))
        lower, upper = _range(leader)
        if max(lower, low) > min(upper, high):
            raise RobotError(
                f"{where}: joint {pair.follower!r} follows {pair.leader!r}, which moves from {lower:.4g} to"
                f" {upper:.4g}, but must be from {low:.4g} to {high:.4g} to keep it within its range"
            )
        if min(upper, high) - max(lower, low) < _POINT < upper - lower:
            continue  # it would leave nothing: a follower's range that was written for the other direction
        leader["lower"], leader["upper"] = max(lower, low), min(upper, high)
        leader["max_velocity"] = min(leader["max_velocity"], follower["max_velocity"] / abs(pair.ratio))
    for pair in pairs:
        leader, follower = tables[pair.leader], tables[pair.follower]
        follower["lower"], follower["upper"] = sorted(map(pair.of, _range(leader)))
        follower["max_velocity"] = leader["max_velocity"] * abs(pair.ratio)
        follower["max_torque"] = leader["max_torque"] / abs(pair.ratio)


def loops_of(model: ModelFile, frames: Mapping[int, Frame]) -> Loops:
    """Return what holds links together besides joints; `frames` are those of the robot's bodies."""
    mj = model.compiled
    loops: list[dict[str, Any]] = []
    notes: list[str] = []
    note = _noting(notes, model, "body")
    mounted = False
    for equality in np.flatnonzero(mj.eq_active0):
        kind, data = mj.eq_type[equality], mj.eq_data[equality]
        rigid = kind == mujoco.mjtEq.mjEQ_WELD
        if not rigid and kind != mujoco.mjtEq.mjEQ_CONNECT:
            continue
        pair = [int(mj.eq_obj1id[equality]), int(mj.eq_obj2id[equality])]
        places = [data[3:6], data[:3]] if rigid else [data[:3], data[3:6]]
        by_sites = mj.eq_objtype[equality] == mujoco.mjtObj.mjOBJ_SITE
        if by_sites:
            places = [mj.site_pos[site] for site in pair]
            pair = [int(mj.site_bodyid[site]) for site in pair]
        of_robot = [body for body in pair if body in frames]
        if len(of_robot) == len(pair) and not (rigid and by_sites):
            first, second = (frames[body] for body in pair)
            place, other = (at - of.offset for at, of in zip(places, (first, second), strict=True))
            loop = {"first": first.link, "second": second.link}
            loop |= {"place": place.tolist(), "other": other.tolist()}
            loops.append(loop | ({"turn": data[6:10].tolist()} if rigid else {}))
        elif rigid and 0 in pair and of_robot and mj.body_parentid[of_robot[0]] == 0:
            mounted = True
        elif of_robot:
            name = mj.body(of_robot[0]).name
            why = (
                "it welds sites, not links" if len(of_robot) > 1 else "its other end is no link of the robot"
            )
            note(name, f"an equality that holds {name!r} is left out: {why}")
    return Loops(tuple(loops), mounted, tuple(notes))


def _noting(notes: list[str], model: ModelFile, kind: str) -> Note:
    return lambda name, text: notes.append(f"{model.at(name, kind)}: {text}")


def _chains(mj: mujoco.MjModel, driven: Collection[str], note: Note) -> list[_Chain]:
    """Return all joints in chains, each led by one that is `driven`, or else by one that follows none."""
    ties: dict[str, list[Coupling]] = {}
    followers = set()
    for tie in _ties(mj, note):
        followers.add(tie.follower)
        ties.setdefault(tie.leader, []).append(tie)
        ties.setdefault(tie.follower, []).append(tie.reversed())
    names = [mj.joint(joint).name for joint in range(mj.njnt) if mj.jnt_type[joint] in _ONE_AXIS]
    chains: list[_Chain] = []
    known: set[str] = set()
    for leader in sorted(names, key=lambda name: (name not in driven, name in followers)):
        if leader in known:
            continue
        ways = {leader: Coupling(leader=leader, follower=leader)}
        waiting = [leader]
        for joint in waiting:  # grows meanwhile
            for tie in ties.get(joint, ()):
                if tie.follower not in ways:
                    ways[tie.follower] = _joined(ways[joint], tie)
                    waiting.append(tie.follower)
        known |= ways.keys()
        chains.append(_Chain(leader, ways))
    return chains


def _joined(first: Coupling, then: Coupling) -> Coupling:
    """Return the coupling of the follower of a follower."""
    ratio, offset = then.ratio * first.ratio, then.of(first.offset)
    return Coupling(leader=first.leader, follower=then.follower, ratio=ratio, offset=offset)


def _ties(mj: mujoco.MjModel, note: Note) -> Iterator[Coupling]:
    """Yield the pairs of joints that equalities bind."""
    for equality in np.flatnonzero(mj.eq_active0):
        data = mj.eq_data[equality].tolist()
        first, second = int(mj.eq_obj1id[equality]), int(mj.eq_obj2id[equality])
        if mj.eq_type[equality] == mujoco.mjtEq.mjEQ_JOINT:
            what = f"joint {mj.joint(first).name!r}"
            terms = {mj.joint(first).name: 1.0}
            bound = {mj.joint(second).name: 1.0} if second >= 0 else {}
        elif mj.eq_type[equality] == mujoco.mjtEq.mjEQ_TENDON:
            what = f"tendon {mj.tendon(first).name!r}"
            terms, bound = _fixed(mj, first), _fixed(mj, second) if second >= 0 else {}
        else:
            continue
        name = next(iter(terms), "")
        for joint, part in bound.items():  # the sum of all terms is constant
            terms[joint] = terms.get(joint, 0.0) - data[1] * part
        terms = {joint: part for joint, part in terms.items() if abs(part) > _TINY}
        if len(terms) == 2 and not any(data[2:5]):
            (follower, own), (leader, other) = terms.items()
            yield Coupling(leader=leader, follower=follower, ratio=-other / own, offset=data[0] / own)
        else:
            note(name, f"the equality of {what} is left out: it does not bind two joints in proportion")


def _pull(chains: list[_Chain], tendons: Mapping[int, Mapping[str, float]]) -> None:
    """Give the chains without a motor those of `tendons`; join the chains that one of them moves."""
    for actuator, tendon in tendons.items():
        free = [each for each in chains if each.stretches(tendon) and not each.pulls]
        rows = {
            other: [each.stretches(its) for each in free]
            for other, its in tendons.items()
            if not any(each.stretches(its) for each in chains if each not in free)
        }
        if len(free) == 1 or (free and np.linalg.matrix_rank([*rows.values()]) == len(free)):
            # As many tendons as joints, as in a differential: each joint moves by itself.
            rows[actuator] = [each.stretches(tendon) for each in free]
            for other, row in rows.items():
                for each, lever in zip(free, row, strict=True):
                    each.pulls += [Pull(other, abs(lever))] if lever else []
        elif free:
            first, by = free[0], free[0].stretches(tendon)
            first.pulls.append(Pull(actuator, sum(each.stretches(tendon) ** 2 for each in free) / abs(by)))
            for each in free[1:]:
                share = each.stretches(tendon) / by
                tie = Coupling(leader=first.leader, follower=each.leader, ratio=share)
                first.ways |= {joint: _joined(tie, way) for joint, way in each.ways.items()}
                chains.remove(each)


def _fixed(mj: mujoco.MjModel, tendon: int) -> dict[str, float]:
    """Return the joints of a tendon with its coefficients; none of one that runs along sites."""
    wraps = range(int(mj.tendon_adr[tendon]), int(mj.tendon_adr[tendon] + mj.tendon_num[tendon]))
    if any(mj.wrap_type[wrap] != mujoco.mjtWrap.mjWRAP_JOINT for wrap in wraps):
        return {}
    return {mj.joint(int(mj.wrap_objid[wrap])).name: float(mj.wrap_prm[wrap]) for wrap in wraps}


def _range(joint: Mapping[str, Any]) -> tuple[float, float]:
    return joint.get("lower", -math.inf), joint.get("upper", math.inf)


_GIVES: Final = {False: 0.1, True: 0.005}
"""Angle in rad, or way in m, by which a servo gives way at its largest torque, if nothing says it."""
_LIMP: Final = {False: 0.3, True: 0.05}
"""Angle in rad, or way in m, from which a servo that the model describes is too soft to hold its joint."""
_STRONGEST: Final = 20.0
"""Largest such torque, as a multiple of what gravity asks of it: more would only make light links tremble."""
_SPARE: Final = 2.0
"""The torque in N m beyond gravity's, which grips and wheels need."""
_SAGS: Final = {False: 0.01, True: 0.001}
"""Angle in rad, or way in m, by which the weight that a joint carries may bend such a servo."""
_BENDS: Final = 0.5
"""Share of that angle by which a leg's joint gives way at what it may need to stand."""
_FIRM: Final = 1.5
"""Stiffness of a leg's joint, as a multiple of that with which the robot would just not fall about it."""
_QUICKEST: Final = 150.0
"""Highest natural frequency of such a servo in rad/s: steps of the physics take 2.5 ms."""
_SLOWEST: Final = 10.0
"""Lowest such frequency."""
_LIGHTEST: Final = 1e-4
"""Least inertia in kg m2 that moves with a joint without a motor: with less, closed chains fly apart."""
_LARGEST_ROTOR: Final = 0.1
"""Largest inertia of a rotor in kg m2 that is added for it, if the model has none."""


def gear_of(
    figure: Figure, joint: int, pulls: Iterable[Pull], torque: float, *, mounted: bool
) -> dict[str, float]:
    """Return the gains of a joint's servo, or the bearings of a joint without a torque.

    They are those of a position servo among `pulls` that can hold the joint; else it neither sags nor swings.
    """
    mj, slides = figure.mj, figure.slides(joint)
    dof = int(mj.jnt_dofadr[joint])
    rotor = float(mj.dof_armature[dof])
    gear = {
        "friction_damping": float(np.ravel(mj.dof_damping[dof])[0]),
        "friction": float(mj.dof_frictionloss[dof]),
        "inertia": rotor,
    }
    held, free = (float(each[dof]) for each in figure.inertias)
    if not torque:
        if free < _LIGHTEST:
            gear["inertia"] = rotor + _LIGHTEST - free
            gear["friction_damping"] = max(gear["friction_damping"], _LIGHTEST * _SLOWEST)
        rest = float(mj.qpos_spring[mj.jnt_qposadr[joint]])
        return gear | {"stiffness": float(np.ravel(mj.jnt_stiffness[joint])[0]), "rest": rest}
    load, standing = figure.load(joint), figure.standing(joint, mounted=mounted)
    for motor, lever in pulls:
        affine = mj.actuator_biastype[motor] == mujoco.mjtBias.mjBIAS_AFFINE
        if affine and mj.actuator_biasprm[motor, 1] < 0.0:
            square = (lever * float(mj.actuator_gear[motor, 0])) ** 2
            stiffness, damping = (-square * mj.actuator_biasprm[motor, 1:3]).tolist()
            if max(load, standing) < _LIMP[slides] * stiffness:
                return gear | {"stiffness": stiffness, "damping": max(damping, 0.0)}
    stiffness = max(
        min(torque, _STRONGEST * max(load, standing) + _SPARE) / _GIVES[slides],
        load / _SAGS[slides],
        standing / (_BENDS * _GIVES[slides]),
        _FIRM * figure.tips(joint, mounted=mounted),
        _SLOWEST**2 * held,
    )
    wanted = stiffness / _QUICKEST**2 - free
    added = 0.0 if rotor else min(max(wanted, 0.0), _LARGEST_ROTOR)
    stiffness = min(stiffness, _QUICKEST**2 * (free + added))
    damping = 2.0 * math.sqrt(stiffness * (held + added))
    return gear | {"inertia": rotor + added, "stiffness": stiffness, "damping": damping}
