"""Debug a running component, and serve its monitor to clients.

`monitor` has the servant of `HfsmMonitor`, and `snapshot` makes the data that it publishes. `breakpoints`,
with `expressions` for their conditions, pauses automata, and `explanation` says why transitions do not fire.
`reload` replaces the component with the present version of its file.
"""
