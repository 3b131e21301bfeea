"""ROS 2 in documents and components, and any robot as a node of ROS 2."""
