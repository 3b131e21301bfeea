"""The simulated Nao: the H25 body in MuJoCo behind the `Robot` protocol, and the command `naoserver-sim`.

Module            What it holds
`body`            the body made from its facts: links, joints, motors, contact shapes, cameras
`self_collision`  which links touch each other
`appearance`      what a person sees of it: a skin, or bare blocks
`lamps`           how the robot's lights look
`contacts`        who touches whom
`world`, `worlds` what surrounds the robot, read from files
`surroundings`    all that in the model; a soccer field in `field`
`model`           all of it compiled, and the robot put on its feet
`control`         setpoints that move at limited speed
`pacing`          simulated time against the wall clock
`simulator`       the physics thread
`stage`           the scene, told and changed
`clock`           the simulated time as a clock
`gl`, `cameras`   the camera thread
`viewer`          MuJoCo's window
`robot`           `SimulatedRobot`
`learning`        environments of Gymnasium in which it learns
`cli`, `command`  the command; several robots at once in `team`
"""
