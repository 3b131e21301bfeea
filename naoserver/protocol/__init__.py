"""What a robot has to do: the protocol of simulated, real and fake robots, its sounds and threads."""
