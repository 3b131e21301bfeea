"""Stubs for parts of `zenoh_ice`, because jedi does not follow descriptors with a ParamSpec."""
