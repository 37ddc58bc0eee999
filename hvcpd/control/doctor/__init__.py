"""The commands of the group “doctor”."""
