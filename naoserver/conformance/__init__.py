"""The conformance suite: tests that say whether a robot keeps the contract of `naoserver.protocol.robot`.

    pytest --pyargs naoserver.conformance --robot my_module:make

`make` is called without arguments, and returns a Robot that is not started, or a context manager that yields
one. The suite starts it, serves it on loopback, calls it as any client does, and lists each sentence of the
contract with what became of it: `holds`, `BROKEN`, or `skipped` with the part that the robot lacks.

**The robot moves.** A test moves one joint at a time, by 0.15 rad at most and slowly, from where the robot is
towards the middle of its range; joints of legs and wheels rest. With `--room`, for a robot with 2 m of free
floor around it, it also walks, crouches and waves. The tests make its motors stiff and, at the end, as
stiff as they were at first.

It needs pytest, as of the extra `test`.
"""
