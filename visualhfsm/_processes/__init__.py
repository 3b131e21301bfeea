"""Components, robots and tests of documents as child processes, and what their output says.

`components`, `robots` and `tests` run them; `ahead` keeps a process that waits to be the next component
(`hfsm_runtime.waiting`). `failures` finds errors in their output, which `visualhfsm._editor.tab` shows as
problems until their code changes; `hfsm_runtime.ending` says how a run ended.
"""
