"""At home in ROS: a bridge process beside the daemon, over its control socket; docs/ros.md describes it."""
