"""Any robot server as a ROS 2 node, with the names of naoqi_driver2: the command `naoserver-ros2`."""
