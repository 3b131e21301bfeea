"""Record a run of a component: everything it did, and everything that came in, to an MCAP file.

`hfsm_recording.messages` defines the contents of a recording; `run` makes one; `hfsm_runtime.replay` replays
it.
"""
