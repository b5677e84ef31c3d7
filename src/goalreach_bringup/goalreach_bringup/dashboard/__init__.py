"""The live page: what the robot senses, believes, decides and learns, in a browser."""
