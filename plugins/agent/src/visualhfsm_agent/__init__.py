"""A server of the Model Context Protocol: an agent draws behaviors, and must prove them before they run."""
