"""Record a run of a component: everything it did, and everything that came in, to an MCAP file.

`messages` says what stands in a recording, `run` records one, and `hfsm_runtime.replay` runs it again.
"""
