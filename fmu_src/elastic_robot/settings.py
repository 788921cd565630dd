"""Numerical settings of the native core, and of what Python has in common with it.

The native FMU carries them in its robot.txt.  Python's own motion has its numbers in `motion.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi


@dataclass(frozen=True)
class Settings:
    """Numbers of stepper and equilibrium; `dataclasses.asdict` gives them by name.

    The ISO 9283 reference path of the example robot is what they were chosen on (docs/performance.md).

    Attributes:
        tcp_per_local_error: Error of the TCP over a long path per local error allowed [m/rad], without
            backlash. Seen: 0.004; the rest is room for other robots and longer paths.
        tcp_per_local_error_with_backlash: The same with backlash. Seen: 4 to 12, where the path enlarges
            errors several hundred times.
        longest_step: Longest step [s]: a fifth of the slowest mode's period (10 Hz).
        first_step: First step, and the one after a gear reverses [s]: the scale of the fastest
            oscillation (235 Hz).
        shortest_step: Shortest step before the integration is given up, part of the longest.
        most_tries, most_tries_per_longest: Tries of a step before the integration is given up: these,
            and those for each longest step in it. Seen, with random robots at 1e-6 m: 22 in 4 ms under
            random forces of 2 kN, 18 for each longest step of 0.3 s; with joints 1000 times as stiff
            (1e9 to 3e10 N m/rad) 109 and 117.
        usual_speed: Where elasticity throws the TCP faster than this [m/s], each joint as if all beyond
            it were in a line, a try counts for as many as it is faster. A bar of steel at its yield
            stress moves at 13 m/s: stress over density and speed of sound, whatever its size. Seen, with
            random robots: 0.3 to 1.4 under random forces of 2 kN, 3 to 19 where 1e5 N act at once.
        usual_local_error: Local error that these numbers are meant for [rad], that of 1e-6 m with
            backlash; a smaller one makes steps shorter, with its sixth root, and allows more of them.
        most_step: Longest communication step that is integrated [s].
        most_deflection: Largest elastic coordinate [rad]: a joint that bends by half a turn has no
            stiffness that a robot file could have.
        shift_by_jump: Shift of the elastic coordinates by a jump J of a drive's third derivative
            inside a step of length h, over J h^3; where that is more than the local error allowed in
            a longest step, a step ends at the jump.
        safety: Part of the step length that the error estimate would allow.
        strongest_cut, fastest_growth: Limits of the ratio of a step length to the one before.
        smallest_growth: A smaller gain of step length is not worth new matrices.
        stretch: Ratio by which a step may exceed its length where that takes it to its target.
        cut_after_failure: Length of the next try over that of a step whose iteration failed.
        iteration: Part of the local error allowed that Newton's method may leave.
        most_passes: Passes of Newton's method before a step counts as failed.
        usual_passes: A step that takes more passes has its matrices built anew for the next.
        same_length: The matrices of a step serve steps that differ from it by this ratio.
        slack: A coordinate changes its law this part of the local error allowed beyond the boundary, so
            that rounding does not change it back.
        slack_of_width: The slack is at most this part of a backlash's half width.
        landing: A step that ends on a boundary may miss it by this part of the slack.
        landing_iteration: Part of that miss that Newton's method may leave.
        most_landings: Tries to end a step on a boundary.
        neutral_torque: A gear with backlash that carries less rests in the middle of its backlash [N m].
            Rounding of the gravity torque of a heavy robot is 1e-12 N m, the smallest load far larger.
        equilibrium_step: Newton's method for an equilibrium ends when no coordinate moves by more
            [rad]; at 3 m reach that is 3e-14 m at the TCP.
        most_equilibrium_passes: Its passes before there is no equilibrium.
        slow_equilibrium: A step of it longer than this part of the one before calls for a new matrix:
            a smooth curve bends.
        across_backlash: Longest of its steps inside a backlash [half widths]: from anywhere it leads out
            of it.
        closest_samples: Samples of a trajectory closer than this are refused [s]: no drive follows them,
            and each may end a step.
        most_sample: Largest time, angle, rate or acceleration of a trajectory [s, rad, rad/s, rad/s^2];
            doubles of that size are 1e-4 apart.
        tries_per_sample: Tries of a step that are allowed besides where a sample has ended one.
        time_slack: A step may start this far from the end of the last one, and a time pass the ends of a
            trajectory by as much [s]: sums of communication steps round.
        time_slack_of_time: And by this part of the time itself, the spacing of 4 to 8 doubles there.
        stop_slack: And by this part of an experiment's length behind its stop time: the sums of some
            millions of steps.
        neighbour_ratio: Ratio of the lengths of two steps up to which commands at the start of both say
            how the drives go on; what the shorter one says counts no farther.
    """

    tcp_per_local_error: float = 1.0
    tcp_per_local_error_with_backlash: float = 20.0
    longest_step: float = 0.02
    first_step: float = 1e-3
    shortest_step: float = 1e-9
    most_tries: int = 2000
    most_tries_per_longest: int = 200
    usual_speed: float = 50.0
    usual_local_error: float = 5e-8
    most_step: float = 3600.0
    most_deflection: float = pi
    shift_by_jump: float = 0.1
    safety: float = 0.9
    strongest_cut: float = 0.2
    fastest_growth: float = 3.0
    smallest_growth: float = 1.2
    stretch: float = 1.05
    cut_after_failure: float = 0.25
    iteration: float = 1e-3
    most_passes: int = 8
    usual_passes: int = 2
    same_length: float = 0.02
    slack: float = 1e-2
    slack_of_width: float = 1e-2
    landing: float = 0.1
    landing_iteration: float = 0.1
    most_landings: int = 20
    neutral_torque: float = 1e-6
    equilibrium_step: float = 1e-14
    most_equilibrium_passes: int = 60
    slow_equilibrium: float = 0.1
    across_backlash: float = 2.0
    closest_samples: float = 1e-6
    most_sample: float = 1e12
    tries_per_sample: int = 3
    time_slack: float = 1e-9
    time_slack_of_time: float = 2.0**-50
    stop_slack: float = 1e-9
    neighbour_ratio: float = 4.0

    def time_rounding(self, time: float) -> float:
        """Return the largest rounding of sums of communication steps near a time [s]."""
        return self.time_slack_of_time * abs(time)

    def slack_at(self, time: float) -> float:
        """Return the slack within which a time counts as another [s]."""
        return self.time_slack + self.time_rounding(time)

    def jump(self, local_error: float) -> float:
        """Return the jump of a drive's third derivative that a step may pass [rad/s^3].

        Args:
            local_error: Local error allowed [rad].
        """
        return local_error / (self.shift_by_jump * self.longest_step**3)


SETTINGS = Settings()
