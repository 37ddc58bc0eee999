"""The window: a live page in the browser about one robot, and the replay of a recorded mission."""
