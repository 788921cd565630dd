"""The FMI interface as data: every variable of the FMU."""
