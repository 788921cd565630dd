"""The store of evaluations: what a process has answered once is not computed again.

`EvaluatedProcess` stands before a process and looks like it, so that the loops know nothing of a store.
"""

from coupling.store.evaluated_process import EvaluatedProcess
from coupling.store.store import Entry, Store, WaitingForOther

__all__ = ["Entry", "EvaluatedProcess", "Store", "WaitingForOther"]
