"""Call states and transitions by their names in messages, and those without one by their ids."""

from __future__ import annotations

from ..document import State, Transition

__all__ = ["state_label", "transition_label"]


def state_label(state: State) -> str:
    """Return how messages call a state."""
    return f"`{state.name.strip()}`" if state.name.strip() else f"state {state.id}"


def transition_label(transition: Transition) -> str:
    """Return how messages call a transition."""
    name = transition.name.strip()
    return f"transition `{name}`" if name else f"transition {transition.id}"
