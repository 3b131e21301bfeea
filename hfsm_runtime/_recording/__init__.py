"""Record a run of a component, everything it did and all of its inputs, to an MCAP file.

`hfsm_runtime.recording_file.messages` defines the contents of a recording; `run` makes one, and
`hfsm_runtime._replay` replays it.
"""
