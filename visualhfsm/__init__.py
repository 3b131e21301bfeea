"""Watch and steer components of hierarchical finite state machines, and edit their documents."""
