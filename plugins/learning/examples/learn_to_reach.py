"""Let a simulated Nao learn to bring its left hand where it is wanted, by nothing but trying.

An evolution strategy: a policy with 30 numbers, small changes of it tried in pairs, and a step towards those
that were paid better. 40 rounds take about a minute.

    python plugins/learning/examples/learn_to_reach.py [ROUNDS]
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

try:
    import gymnasium
except ModuleNotFoundError as error:
    sys.exit(f"{error.name} is not installed; type: pip install 'visualhfsm[learning]'")

Array = NDArray[np.float64]
Environment = gymnasium.Env[Any, Any]

PAIRS = 6
PLACES = 2  # tried with each change, the same for both of a pair
STEPS = 75  # of 20 ms
SPREAD = 0.1
RATE = 0.15
MOTORS, ANGLES, WAY = 5, slice(0, 5), slice(13, 16)


def act(policy: Array, observation: Array) -> Array:
    """Return the action of a policy: linear in the way that is left, turned by where the shoulder is."""
    seen = np.concatenate((observation[WAY], observation[ANGLES.start : 2], (1.0,)))
    return np.tanh(policy.reshape(MOTORS, 6) @ seen).astype(np.float32)


def paid(environment: Environment, policy: Array, seed: int) -> float:
    """Return the mean reward of a step in an episode."""
    observation, _ = environment.reset(seed=seed)
    total = 0.0
    for _ in range(STEPS):
        observation, reward, ended, _, _ = environment.step(act(policy, observation))
        total += float(reward)
        if ended:
            break
    return total / STEPS


def main(rounds: int) -> None:
    """Learn, and print the progress."""
    environment = gymnasium.make("visualhfsm_learning:Nao/Reach-v0", disable_env_checker=True)
    rng = np.random.default_rng(1)
    policy = np.zeros(MOTORS * 6)
    examined = range(1000, 1006)
    before = np.mean([paid(environment, policy, seed) for seed in examined])
    print(f"before: {before:+.3f} a step")
    for number in range(1, rounds + 1):
        changes = rng.standard_normal((PAIRS, policy.size))
        gains = np.zeros(PAIRS)
        seeds = rng.integers(1000, size=PLACES).tolist()
        for pair, change in enumerate(changes):
            for seed in seeds:
                gains[pair] += paid(environment, policy + SPREAD * change, seed)
                gains[pair] -= paid(environment, policy - SPREAD * change, seed)
        policy += RATE * gains @ changes / (PAIRS * gains.std() + 1e-9)
        if number % 10 == 0 or number == rounds:
            after = np.mean([paid(environment, policy, seed) for seed in examined])
            print(f"after {number} rounds: {after:+.3f} a step", flush=True)
    environment.close()


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)
