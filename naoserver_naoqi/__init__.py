"""The real robot: what implements `naoserver.robot.Robot` over libqi, and the command `naoserver-naoqi`.

`libqi` alone imports `qi`; everything else stands on the small protocol of `link`. `connection` keeps a link
alive and finds the robot again when it was lost, `robot` puts the parts together: `state` (what is measured),
`joints`, `walk`, `cameras`, `lights`, `voice`, `postures`, and `care` (what happens to it at start and end).
"""
