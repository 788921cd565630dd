"""How sure a command is: robots sampled from what is uncertain, simulated by many processes."""
