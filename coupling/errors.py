"""The exceptions of this package; a run that does not converge is a result, not an exception."""


class CouplingError(Exception):
    """Base of every error this package raises for a user's mistake or an impossible request."""


class CaseError(CouplingError):
    """A case file or a file that it names is unreadable, incomplete or contradictory."""


class PlanningError(CouplingError):
    """The robot cannot follow a tool path: out of reach, beyond a limit or singular."""


class SimulationError(CouplingError):
    """The FMU could not be loaded or refused a step."""


class ProcessError(CouplingError):
    """A process has no answer: it cannot follow the path, or its program or FMU failed."""


class ResultError(CouplingError):
    """A run folder cannot be read or written."""


class BuildError(CouplingError):
    """An FMU cannot be written."""
