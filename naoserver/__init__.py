"""Shared by all robot servers: the robot protocol, the servants, the safety layer, the bodies of robots.

A command passes these rooms from a client to the robot, each of which stands on those below it:

- `eyes/`: sees what a robot's pictures show, beside its server (`nao eyes`);
- `serving/`: one servant for each interface, and what puts them in front of the parts of a robot;
- `moves/`: what moves joints for long;
- `safety/`: who may move a robot, how far and how fast, and who stops it;
- `protocol/`: `Robot`, what a robot has to do: read the joints, command positions and speeds, take an image;
- `bodies/`: what robots are, as descriptions (decision 34): what a robot lacks is not served.

Servants and safety are written once, on the protocol. It is implemented by a robot without physics (`fake/`),
by `naoserver_sim`, and by servers of real hardware, which share `hardware/`. `conformance/` is the contract
as tests that are shipped. `robot.py`, `body.py` and `errors.py` are the doors for hardware of one's own.
"""
