"""Debug a running component, and serve that to others.

`monitor` is the servant of `HfsmMonitor` and `snapshot` what it shows. `breakpoints`, with `expressions` for
their conditions, and `explanation` say where automata stop and why; `reload` replaces the component by what
its file holds now.
"""
