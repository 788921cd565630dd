"""From a run's command to a robot program: its points, frames and checks, and what the file leaves."""
