"""Record a run of a component, everything it did and all of its inputs, to an MCAP file.

`hfsm_recording.messages` defines the contents of a recording; `run` makes one; `hfsm_runtime.replay` replays
it.
"""
