"""What an action of a task can be: one life cycle for programs, Python objects, other processes and pins."""
