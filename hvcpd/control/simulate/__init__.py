"""The commands of the group “simulate”."""
