"""See what a component of hierarchical finite state machines does."""
