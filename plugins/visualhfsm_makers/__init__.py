"""Programs of the makers of the G1 and the T1: they find the simulated robot as the real one."""
