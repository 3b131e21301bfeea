"""What moves joints for long: walks, paths, and motions made of key frames with the ways between postures.

`walk` is the walk, `player` plays motions (`motion_file`) and ways between postures (`routes`): these claim
their joints meanwhile, so that other commands to them are refused. `joint_paths` moves joints along curves,
and `effector_paths` effectors through places.
"""
