"""The store of evaluations: what a process has answered once is not computed again.

`StoredProcess` stands before a process and looks like it, so that the loops know nothing of a store.
"""

from coupling.store.store import Entry, Store, WaitingForOther
from coupling.store.stored_process import StoredAnswer, StoredProcess

__all__ = ["Entry", "Store", "StoredAnswer", "StoredProcess", "WaitingForOther"]
