"""The real robot: what implements `naoserver.robot.Robot` over libqi, and the command `naoserver-naoqi`."""
