"""One robot, whole, without I/O."""
