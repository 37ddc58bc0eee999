"""Stateful stand-ins for a robot's devices, at the outermost seam: bytes on a wire, samples in the air.

They share no code with what they test. Time is passed in, and all chance is seeded.
"""
