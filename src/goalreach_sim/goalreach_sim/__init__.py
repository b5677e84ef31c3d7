"""The Nomad 200 in its arena: kinematics, bumpers, odometry, head, renderer and simulator."""
