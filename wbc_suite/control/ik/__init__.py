"""From goals of frames to joint commands: whole-body inverse kinematics."""
