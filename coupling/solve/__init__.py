"""The weak coupling and what corrects a command."""
