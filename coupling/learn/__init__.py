"""Parameters of the robot one has, from measured passes of a command: docs/learn.md."""
