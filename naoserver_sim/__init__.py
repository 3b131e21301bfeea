"""The simulated Nao: a body in MuJoCo behind the `Robot` protocol, and the command `naoserver-sim`.

Module            Contents
`scene.xml`       the basis of every model: physics, light, gains, collision classes
`body`            the body made from its facts: links, joints, motors, contact shapes, cameras, sensors
`appearance`      its visible shapes, read from `naoserver.looks`; the lamps
`world`, `worlds` the surroundings of the robot, read from files
`surroundings`    the surroundings in the model
`model`           the compiled whole, and the robot put on its feet
`motors`          setpoints that move at limited speed, stiffness, heat
`simulator`       the physics thread, its pace against the wall clock, and its time as a clock
`senses`, `walk`  the senses and the walk of the robot
`stage`           the scene, read and changed
`cameras`         the camera thread
`geometry`        the world as data, and the default body as JSON, for the editor
`robot`           `SimulatedRobot`
`learning`        Gymnasium environments in which it learns
`command`         the command, for one robot or several
"""
