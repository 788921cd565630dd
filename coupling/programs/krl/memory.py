"""Variables of KRL programs: of a routine, of its module's .dat, and of all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import floor

from coupling.errors import ProgramError
from coupling.programs.krl.values import (
    AXIS_KEYS,
    FRAME_KEYS,
    Aggregate,
    UnknownValueError,
    Value,
    copy_value,
    describe_value,
    is_number,
    single,
)
from coupling.programs.unknown import Unknown

# Name and, of an array's element, its indices.
Key = tuple[str, tuple[int, ...]]
Components = tuple[str, ...]


@dataclass
class Names:
    """Variables of one scope.

    Attributes:
        types: Types of those that are declared, by name.
        values: Values of those that have one.
    """

    types: dict[str, str] = field(default_factory=dict)
    values: dict[Key, Value] = field(default_factory=dict)


@dataclass
class Variables:
    """All variables while a program runs.

    Attributes:
        common: Those of all modules, with what is declared in files that are not at hand.
        modules: Those of the .dat files, by the modules' names.
        structures: Types of the components of structures that the program defines.
        ambiguous: Names of common ones that several files define.
    """

    common: Names = field(default_factory=Names)
    modules: dict[str, Names] = field(default_factory=dict)
    structures: dict[str, dict[str, str]] = field(default_factory=dict)
    ambiguous: set[str] = field(default_factory=set)
    scopes: tuple[Names, ...] = ()

    def __post_init__(self) -> None:
        self.scopes = self.scopes or (self.common,)

    def enter(self, module: str, local: Names) -> tuple[Names, ...]:
        """Look for names in a routine of a module from now on; return where they were looked for."""
        before = self.scopes
        self.scopes = (local, self.modules.setdefault(module, Names()), self.common)
        return before

    def declare(self, name: str, kind: str, is_global: bool = False) -> None:
        """Make a variable of a type known, without a value."""
        scope = self.common if is_global else self.scopes[0]
        scope.types[name] = kind

    def read(self, key: Key, components: Components) -> Value:
        """Return a value.

        Raises:
            UnknownValueError: If there is none.
        """
        value = self._find(key)
        for component in components:
            if isinstance(value, Unknown):
                break
            value = value.get(component) if isinstance(value, dict) else None
            if value is None:
                break
        if value is None:
            raise UnknownValueError(Unknown(format_variable(key, components)))
        if isinstance(value, Unknown):
            raise UnknownValueError(value)
        return value

    def write(self, key: Key, components: Components, value: Value, where: str) -> None:
        """Give a variable, or a component of it, a value.

        Raises:
            ProgramError: If it is of another type.
        """
        scope = self._scope(key[0])
        kind = scope.types.get(key[0], "")
        if not components:
            scope.values[key] = self._of_kind(kind, copy_value(value), where)
            return
        whole = scope.values.get(key)
        if whole is None and not kind:
            whole = Unknown(format_variable(key, ()))  # declared elsewhere it has a value
        inner = scope.values[key] = _make_structure(whole, kind)
        for component in components[:-1]:
            kind = self._component_kind(kind, component)
            part = inner[component] = _make_structure(inner.get(component), kind)
            inner = part
        last = components[-1]
        kind = (
            "REAL" if last in FRAME_KEYS and is_number(value) else self._component_kind(kind, last)
        )
        inner[last] = self._of_kind(kind, copy_value(value), where)

    def _component_kind(self, kind: str, component: str) -> str:
        return self.structures.get(kind, {}).get(component, "")

    def _find(self, key: Key) -> Value | None:
        for scope in self.scopes:
            if key in scope.values:
                if scope is self.common and key[0] in self.ambiguous:
                    return Unknown(f"{key[0]}, which is GLOBAL in several .dat,")
                return scope.values[key]
            if key[0] in scope.types:
                return None
        return None

    def _scope(self, name: str) -> Names:
        for scope in self.scopes:
            if name in scope.types:
                return scope
        return self.common

    def _of_kind(self, kind: str, value: Value, where: str) -> Value:
        """Return a value as a variable of a type keeps it."""
        if isinstance(value, Unknown) or not kind:
            return value
        if kind in ("INT", "REAL"):
            if not is_number(value):
                raise ProgramError(
                    f"{where}: expected a number for {kind}, got {describe_value(value)}"
                )
            assert not isinstance(value, str | dict)
            return floor(value + 0.5) if kind == "INT" else single(value)
        if kind == "BOOL" and not isinstance(value, bool):
            raise ProgramError(f"{where}: expected TRUE or FALSE, got {describe_value(value)}")
        if isinstance(value, dict):
            return self._structure(self.structures.get(kind, {}), value, where)
        return value

    def _structure(self, kinds: Mapping[str, str], value: Aggregate, where: str) -> Aggregate:
        return {key: self._of_kind(kinds.get(key, ""), part, where) for key, part in value.items()}


def _make_structure(value: Value | None, kind: str) -> Aggregate:
    """Return a value as a structure whose components are set: empty where it has none."""
    if isinstance(value, dict):
        return value
    keys = AXIS_KEYS if "AXIS" in kind else FRAME_KEYS
    return (
        {k: replace(value, name=f"{k} of {value.name}") for k in keys}
        if isinstance(value, Unknown)
        else {}
    )


def format_variable(key: Key, components: Components) -> str:
    """Return a variable as a program writes it."""
    name, indices = key
    element = f"[{','.join(str(i) for i in indices)}]" if indices else ""
    return ".".join((name + element, *components))
