"""The store of evaluations: what a process has answered once is not computed again.

`StoredProcess` stands before a process and looks like it, so that the loops know nothing of a store.
"""

from coupling.store.store import Entry, Store, Waits
from coupling.store.stored_process import Answered, StoredProcess

__all__ = ["Answered", "Entry", "Store", "StoredProcess", "Waits"]
