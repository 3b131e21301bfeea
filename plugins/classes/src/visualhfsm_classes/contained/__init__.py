"""The far end of a component whose Python runs in another process, which nobody has to trust.

The near end has clock, robot, automata, transitions and timers. It asks the far end to run pieces of code,
and does what these ask for in turn. `_protocol.py` has the messages of both.
"""
