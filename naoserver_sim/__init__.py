"""The simulated robot: any body in MuJoCo behind the `Robot` protocol, and the command `naoserver-sim`.

Module            Contents
`scene.xml`       the basis of every model: physics, light, gains, collision classes
`body`            the body made from its facts: links, joints, motors, contact shapes, cameras, sensors
`named_body`      the body of a name or a user's file; a plug-in makes one of a model
`self_collision`  the command that finds the tables which keep a body from hitting itself
`appearance`      its visible shapes, read from `naoserver.bodies.looks`; the lamps
`world`, `worlds` the surroundings of the robot, read from files
`surroundings`    the surroundings in the model
`model`           a robot and its world, compiled; `standing` puts the robot on its feet
`together`, `share` several robots in one model: one physics, in whose arrays each has a share; each
                  computes with its own model
`motors`          setpoints that move at limited speed, stiffness, heat; the gears
`simulator`       the physics thread, its pace against the wall clock, and its time as a clock
`senses`          the senses of the robot
`locomotion`      what moves it over the floor: the base of `walk` (fast steps of a Nao), `footsteps` (legs
                  that hold angles) and `wheels`; `robot` chooses by the type of `body.walk`
`balance`         the ankles of a Nao that keep it upright, over its `support_polygon`
`stage`           the scene, read and changed, and as data for viewers
`cameras`         the camera thread; `image_sensor` makes its images as imperfect as real ones
`robot`, `arena`  `SimulatedRobot`, and `Arena` for several in one world
`command`         the command, for one robot or several

Three activities run in parallel, and none waits for the others: physics, which publishes a snapshot after
each step; rendering, which copies the state and draws only requested images; and serving, which reads
snapshots without a lock. The same seed and the same commands at the same times give the same states bit by
bit. docs/explanation/simulation.md describes models and figures.
"""
