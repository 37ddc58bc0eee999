"""Skills as actions of a task: one life cycle for programs, Python objects, other processes and pins."""
