"""What jedi reads in place of parts of `zenoh_ice`: it follows no descriptors with a ParamSpec."""
