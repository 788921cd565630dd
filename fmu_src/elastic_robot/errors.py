"""The exceptions of this package; all share one base, so that one `except` catches them."""


class ElasticRobotError(Exception):
    """Base of every error this package raises for a user's mistake or an impossible request."""


class RobotFileError(ElasticRobotError):
    """A robot description is unreadable, incomplete or not physical."""


class TrajectoryError(ElasticRobotError):
    """A joint trajectory is unreadable, or was asked for a time outside its range."""


class ParameterError(ElasticRobotError):
    """A parameter or input of the running model has a value it cannot take."""


class EquilibriumError(ElasticRobotError):
    """No static equilibrium was found: the robot is too soft for the load."""


class IntegrationError(ElasticRobotError):
    """The motion could not be integrated: too fast for the smallest step, or unstable."""
