"""The inverse of the moving robot: the motion of its drives that keeps the tool on a path."""
