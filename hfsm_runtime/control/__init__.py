"""Show what a running component does, and steer it.

`monitor` is the servant, `snapshot` says what it shows; `steering` takes the requests. `breakpoints` with
`expressions` and `explanation` answer what a debugger asks; `loading` and `reloading` exchange the
component for what its file holds now, with `replacement` and `carrying`.
"""
