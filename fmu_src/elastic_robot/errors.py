"""The exceptions of this package; all share one base, so that one `except` catches them."""


class ElasticRobotError(Exception):
    """Base of every error this package raises for a user's mistake or an impossible request.

    Attributes:
        may_retry: Whether all is as before, and another value or step may do.
    """

    may_retry = False


class RobotFileError(ElasticRobotError):
    """A robot description is unreadable, incomplete or not physical."""


class TrajectoryError(ElasticRobotError):
    """A joint trajectory is unreadable, or was asked for a time outside its range."""


class ParameterError(ElasticRobotError):
    """A parameter or input of the running model has a value it cannot take."""


class RangeError(ParameterError):
    """A variable is given a value that it cannot take; it keeps the one that it has."""

    may_retry = True


class EquilibriumError(ElasticRobotError):
    """No static equilibrium was found: the robot is too soft for the load."""


class IntegrationError(ElasticRobotError):
    """The motion could not be integrated: too fast for the smallest step, or unstable."""


class LifeCycleError(ElasticRobotError):
    """A call is made before or after its time: a step before the initialisation, say."""


class StateError(ElasticRobotError):
    """A saved state is damaged or belongs to another robot."""
