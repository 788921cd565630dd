"""`elastic_robot.coupling`, the desk side, where it is a checkout's folder `coupling`.

Every module is loaded once, whichever of its two names it is imported by: a class that existed twice
would not be itself.  A wheel has the package itself in this file's place; FMUs have neither.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Sequence
from importlib.abc import InspectLoader, Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import CodeType, ModuleType

_PACKAGE = "coupling"


class _SameModules(MetaPathFinder, Loader):
    """Finds elastic_robot.coupling.NAME, and gives the module coupling.NAME for it."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if not name.startswith(f"{__name__}."):
            return None
        spec = importlib.util.find_spec(_name(name))
        if spec is None:
            return None
        package = spec.submodule_search_locations is not None
        return ModuleSpec(name, self, origin=spec.origin, is_package=package)

    def exec_module(self, module: ModuleType) -> None:
        sys.modules[module.__name__] = importlib.import_module(_name(module.__name__))

    def get_code(self, name: str) -> CodeType | None:
        """Return the code of a module that `python -m` runs."""
        spec = importlib.util.find_spec(_name(name))
        assert spec is not None
        assert isinstance(spec.loader, InspectLoader)
        return spec.loader.get_code(spec.name)


def _name(name: str) -> str:
    return _PACKAGE + name.removeprefix(__name__)


def _checkouts_package() -> ModuleType:
    """Return the checkout's package.

    Raises:
        ImportError: If another one has its name.
    """
    package = importlib.import_module(_PACKAGE)
    expected = Path(__file__).resolve().parents[2] / _PACKAGE / "__init__.py"
    if package.__file__ is None or Path(package.__file__).resolve() != expected:
        raise ImportError(
            f"{_PACKAGE}: expected {expected}, got {package.__file__ or package}, which Python finds"
            " first: rename or uninstall that, or install the wheel, which has no module of this name"
        )
    return package


_package = _checkouts_package()
sys.meta_path.insert(0, _SameModules())
sys.modules[__name__] = _package
