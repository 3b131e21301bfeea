"""Record a run of a component: everything it did, and everything that came in, to an MCAP file.

`hfsm_recording.messages` says what stands in a recording; `run` makes one; `hfsm_runtime.replay` replays it.
"""
