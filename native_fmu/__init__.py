"""The native FMU: the robot as text, the C core of `fmu_src/native` compiled, both packed."""
