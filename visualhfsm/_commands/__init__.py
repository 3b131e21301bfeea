"""The command `visualhfsm`: `app` has all of its verbs, and each longer one a module.

`plugged` adds the commands of plug-ins. `template/` and `template_hardware/` are the projects that `new`
makes.
"""
