"""The FMI interface as data, and the values and states of an instance."""
