"""How long work will still take, told once its speed is known."""

from __future__ import annotations

from bisect import bisect_left

# So long a speed is watched before it is believed [s], in so many reports, and by this factor that of
# the second half of that time may differ from the whole's: a process that starts is slow at first.
_WATCHED, _REPORTS, _STEADY = 2.0, 3, 1.5
# Reports that are kept; of more every other one is dropped.
_KEPT = 128


class RemainingTime:
    """Estimates the remaining time of work from its reports.

    The time before the first report, in which processes start and libraries are loaded, is no work.
    """

    def __init__(self) -> None:
        self._times: list[float] = []
        self._done: list[int] = []

    def report(self, now: float, done: int) -> None:
        """Note how far the work is; steps that were undone begin it anew.

        Args:
            now: Time [s].
            done: Steps that are done.
        """
        if self._done and done < self._done[-1]:
            self._times, self._done = [], []
        if done and (not self._done or done > self._done[-1]):
            self._times.append(now)
            self._done.append(done)
            if len(self._times) > _KEPT:
                self._times, self._done = self._times[::2], self._done[::2]

    def ahead(self, total: int) -> float | None:
        """Return the time that the work will still take [s]; None while its speed is not known.

        Example:
            >>> work = RemainingTime()
            >>> for second in range(5): work.report(10.0 + second, 100 * (second + 1))
            >>> work.ahead(1000)
            5.0
        """
        times, done = self._times, self._done
        if len(times) < _REPORTS or times[-1] - times[0] < _WATCHED:
            return None
        half = min(bisect_left(times, 0.5 * (times[0] + times[-1])), len(times) - 2)
        whole, recent = ((done[-1] - done[k]) / max(times[-1] - times[k], 1e-9) for k in (0, half))
        if not whole / _STEADY < recent < whole * _STEADY:
            return None
        return (total - done[-1]) / recent
