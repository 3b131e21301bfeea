"""Any robot server as a node of ROS 2, with the names of naoqi_driver2: command `naoserver-ros2`."""
