"""What a robot is written as for one reader: URDF dialects, SRDF, ROS 2, USD."""
