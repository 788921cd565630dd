"""What fits of a robot's parameters share: parameters, verdicts, and the file that they end in."""
