"""Gymnasium environments in which a simulated Nao learns, in one process and without servers.

Importing this package registers them: `gymnasium.make("visualhfsm_learning:Nao/Walk-v0")` does both.

`environment` has the common part: a robot on a virtual clock, and the same episode for the same seed;
`tasks` has the environments themselves.
"""

from __future__ import annotations

try:
    import gymnasium
except ModuleNotFoundError as error:  # pragma: no cover - nothing is installed without it where tests run
    message = f"{error.name} is not installed; type: pip install 'visualhfsm[learning]'"
    raise ModuleNotFoundError(message, name=error.name) from error

ENVIRONMENTS = {"Nao/Walk-v0": 1000, "Nao/Reach-v0": 250, "Nao/StandUp-v0": 1250}
"""The registered environments, and the steps of 20 ms after which an episode is truncated."""

for _name, _steps in ENVIRONMENTS.items():
    if _name not in gymnasium.registry:
        _class = f"{_name[len('Nao/') : -len('-v0')]}Environment"
        gymnasium.register(
            id=_name, entry_point=f"visualhfsm_learning._tasks:{_class}", max_episode_steps=_steps
        )
