"""What crosses borders: value types, angles, the camera model, topics and message codecs."""
