"""The compiled control loop: MuJoCo's arrays, records of laws, and the physics step."""
