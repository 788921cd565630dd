"""Data and routines by their names: those of a module, of others in its file, and of files with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from coupling.errors import ProgramError
from coupling.programs.rapid.predefined import PREDEFINED
from coupling.programs.rapid.statements import modules_of
from coupling.programs.rapid.syntax import (
    Component,
    DataDeclaration,
    Element,
    Expression,
    Name,
    RapidModule,
    RapidRoutine,
)
from coupling.programs.rapid.values import Data, Kinds, Value, numbers_of
from coupling.programs.reading import ReadingNotes
from coupling.programs.unknown import Unknown


@dataclass
class RapidVariable:
    """Data while a program is read.

    Attributes:
        interrupted: Trap that may change it at any time; empty where there is none.
    """

    data: Data
    storage: str = "VAR"
    interrupted: str = ""

    def set(self, value: Value) -> None:
        """Give it another value of its kind."""
        if not self.interrupted:
            self.data = Data(self.data.kind, value, self.data.rank)


@dataclass
class RoutineScope:
    """What a routine sees while it is executed.

    Attributes:
        module: Module that it stands in.
        data: Its parameters and data, by names in capitals.
    """

    module: RapidModule
    data: dict[str, RapidVariable] = field(default_factory=dict)


@dataclass
class RapidMemory:
    """Modules that are loaded, and the values of their data.

    Attributes:
        evaluate: Function that gives the value of an expression in a scope, at a place.
        modules: Modules of the file that is read.
        others: Texts of these, by file name.
        notes: Notes, which tell the files that belong to the program.
    """

    evaluate: Callable[[Expression, RoutineScope, str], Data]
    modules: list[RapidModule]
    others: Mapping[str, str]
    notes: ReadingNotes
    kinds: Kinds = field(default_factory=Kinds)
    _variables: dict[tuple[int, str], RapidVariable | None] = field(default_factory=dict)
    _undeclared: dict[str, RapidVariable] = field(default_factory=dict)
    _parsed: list[RapidModule] | None = None
    _unreadable: list[str] = field(default_factory=list)
    _cache: dict[tuple[str, str], RapidModule | None] = field(default_factory=dict)
    _used: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        for module in self.modules:
            self.kinds.define(module.records, module.file)

    def variable(self, name: str, scope: RoutineScope) -> RapidVariable | None:
        """Return the data of a name; None where no text gives them a value."""
        key = name.upper()
        if (local := scope.data.get(key)) is not None:
            return local
        if (variable := self._variable_in(scope.module, key)) is not None:
            return variable
        for module in self.modules:
            declared = module.data.get(key)
            if module is scope.module or declared is None or declared.is_local:
                continue
            if (variable := self._variable_in(module, key)) is not None:
                return variable
        if key in PREDEFINED:
            return RapidVariable(PREDEFINED[key], "CONST")
        if key in self._undeclared:
            return self._undeclared[key]
        other = self._other(key, "data", scope)
        return None if other is None else self._variable_in(other, key)

    def undeclared(self, name: str) -> RapidVariable:
        """Return new data of a name that no text declares, which the program gives a value."""
        return self._undeclared.setdefault(
            name.upper(), RapidVariable(Data("", Unknown(repr(name))))
        )

    def changeable(self, target: Expression | None, scope: RoutineScope) -> RapidVariable | None:
        """Return the data that an expression names, in whole or in part; None for none or constants."""
        while isinstance(target, Component | Element):
            target = target.record if isinstance(target, Component) else target.array
        if not isinstance(target, Name):
            return None
        variable = self.variable(target.name, scope) or self.undeclared(target.name)
        return None if variable.storage == "CONST" else variable

    def routine(self, name: str, scope: RoutineScope) -> tuple[RapidRoutine, RapidModule] | None:
        """Return the routine of a name and its module; None where there is none."""
        key = name.upper()
        if key in scope.module.routines:
            return scope.module.routines[key], scope.module
        for module in self.modules:
            routine = module.routines.get(key)
            if routine is not None and not routine.is_local:
                return routine, module
        other = self._other(key, "routines", scope)
        return None if other is None else (other.routines[key], other)

    def missing(self) -> str:
        """Return what to say where a name is missing: files that could not be read, if any."""
        return f" ({self._unreadable[0]})" if self._unreadable else ""

    def _variable_in(self, module: RapidModule, key: str) -> RapidVariable | None:
        """Return data that a module declares; PERS without a value are the controller's."""
        declared = module.data.get(key)
        if declared is None or (declared.storage == "PERS" and declared.initial is None):
            return None
        place = id(module), key
        if place not in self._variables:
            self._variables[place] = None  # while its value is evaluated
            self._variables[place] = self.declared(declared, RoutineScope(module))
        variable = self._variables[place]
        if variable is None:
            raise ProgramError(
                f"{declared.where}: expected a value of {declared.name}, got one that needs itself"
            )
        return variable

    def declared(self, declared: DataDeclaration, scope: RoutineScope) -> RapidVariable:
        """Return data as they are declared."""
        where, kind = declared.where, declared.kind
        extents = []
        for extent in declared.extents:
            sizes = numbers_of(self.evaluate(extent, scope, where).value, "size of an array", where)
            if len(sizes) != 1 or not 1.0 <= sizes[0] <= 1e6:
                raise ProgramError(f"{where}: expected sizes of an array from 1, got {sizes}")
            extents.append(int(sizes[0]))
        rank = len(extents)
        if declared.initial is None:
            value = self.kinds.empty(kind, tuple(extents), where)
        else:
            initial = self.evaluate(declared.initial, scope, where)
            value = self.kinds.shaped(kind, initial.value, where, rank)
        return RapidVariable(Data(kind, value, rank), declared.storage)

    def _other(self, key: str, what: str, scope: RoutineScope) -> RapidModule | None:
        """Return the module of another file that has data or a routine, which no other file has."""
        place = what, key
        if place not in self._cache:
            self._cache[place] = self._search(key, what, scope)
        return self._cache[place]

    def _search(self, key: str, what: str, scope: RoutineScope) -> RapidModule | None:
        holders = []
        for module in self._parsed_others():
            declaration = (module.data if what == "data" else module.routines).get(key)
            if declaration is None or declaration.is_local:
                continue
            if (
                isinstance(declaration, DataDeclaration)
                and declaration.storage == "PERS"
                and declaration.initial is None
            ):
                continue
            holders.append((module, declaration.name))
        if not holders:
            return None
        (module, name), *others = holders
        if others:
            raise ProgramError(
                f"{scope.module.file}: expected one {name} in the files of its folder, got one in"
                f" {module.file} and {others[0][0].file}: keep the modules of one program together"
            )
        if module.file not in self._used:
            self._used.add(module.file)
            self.notes.assume(
                f"{module.file}, which lies in its folder, belongs to it: it has {name}"
            )
        self.kinds.define(module.records, module.file)
        return module

    def _parsed_others(self) -> list[RapidModule]:
        """Return the modules of the other files; those that cannot be read are kept in mind."""
        if self._parsed is None:
            self._parsed = []
            for name, text in self.others.items():
                try:
                    self._parsed += modules_of(text, name)
                except ProgramError as cause:
                    self._unreadable.append(f"{name} cannot be read: {cause}")
        return self._parsed
