"""Files that users write and read: TOML, robot files, URDF, CSV tables."""
