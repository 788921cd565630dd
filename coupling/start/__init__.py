"""A first case: from an example, for any robot."""
