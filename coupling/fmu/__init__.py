"""FMUs driven in processes of their own."""
