"""See and steer components of hierarchical finite state machines, and keep their documents."""
