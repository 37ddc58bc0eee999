"""The commands of the group “enrol”."""
