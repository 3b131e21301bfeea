"""Look for what keeps a robot and its programs from working together, and say how to fix it."""
