"""The simulated Nao: the body in MuJoCo behind the `Robot` protocol, and the command `naoserver-sim`.

Module            What it holds
`scene.xml`       what every model begins with: physics, light, gains, what touches what
`body`            the body made from its facts: links, joints, motors, contact shapes, cameras, sensors
`appearance`      what a person sees of it, read from skin.toml and skin.obj; the lamps
`world`, `worlds` what surrounds the robot, read from files
`surroundings`    all that in the model
`model`           all of it compiled, and the robot put on its feet
`motors`          setpoints that move at limited speed, stiffness, heat
`simulator`       the physics thread, its pace against the wall clock, and its time as a clock
`senses`, `walk`  what the robot feels, and how it walks
`stage`           the scene, read and changed
`cameras`         the camera thread
`geometry`        the visible shapes as JSON, for the editor
`robot`           `SimulatedRobot`
`learning`        environments of Gymnasium in which it learns
`command`         the command, of one robot or of several at once
"""
