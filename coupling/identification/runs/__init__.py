"""Parameters of the robot one has, from measured runs of a command: docs/next.md."""
