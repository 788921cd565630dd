"""Statements, routines and modules of RAPID text."""

from __future__ import annotations

import re

from coupling.errors import ProgramError
from coupling.programs.rapid.expressions import Words
from coupling.programs.rapid.syntax import (
    Assignment,
    Block,
    Connect,
    DataDeclaration,
    Expression,
    For,
    If,
    Jump,
    Parameter,
    RapidInstruction,
    RapidModule,
    RapidRoutine,
    Return,
    Statement,
    Test,
    While,
)
from coupling.programs.rapid.values import components

# What a controller writes above a module.
_HEADER = re.compile(r"^[ \t]*%%%[ \t]*$.*?^[ \t]*%%%[ \t]*$", re.DOTALL | re.MULTILINE)
_STORAGES = ("CONST", "PERS", "VAR")
_HANDLERS = ("BACKWARD", "ERROR", "UNDO")
_ROUTINE_ENDS = {"PROC": "ENDPROC", "FUNC": "ENDFUNC", "TRAP": "ENDTRAP"}
_CLOSING_WORDS = "ENDPROC ENDFUNC ENDTRAP ENDMODULE ENDIF ENDFOR ENDWHILE ENDTEST ENDRECORD"
_CLOSING = frozenset(_CLOSING_WORDS.split())
# Statements in each other, at most.
_MAX_NESTING = 30


def modules_of(text: str, file: str) -> list[RapidModule]:
    """Return the modules of a text.

    Statements outside of routines are those of a procedure without a name, for excerpts.

    Args:
        text: Text of the file.
        file: Its name, for messages.

    Raises:
        ProgramError: With the line, what was expected and what was got.
    """
    # The controller's lines stay empty lines.
    bare = _HEADER.sub(lambda header: "\n" * header[0].count("\n"), text)
    words = Words(bare, file)
    modules: list[RapidModule] = []
    while words.kind != "end":
        is_wrapped = words.takes("MODULE")
        if is_wrapped:
            words.name("the name of a module")
            if words.takes("("):
                words.listed(")")
        modules.append(_module(words, file, is_wrapped))
    return modules


def _module(words: Words, file: str, is_wrapped: bool) -> RapidModule:
    module = RapidModule(file)
    loose: list[Statement] = []
    where = words.where
    while not (words.takes("ENDMODULE") if is_wrapped else words.kind == "end"):
        if words.word == "MODULE" and not is_wrapped and words.kind == "name":
            break
        is_local = words.takes("LOCAL")
        if not is_local:
            words.takes("TASK")
        if words.word in _ROUTINE_ENDS and words.kind == "name":
            routine = _routine(words, is_local)
            if module.routines.setdefault(routine.name.upper(), routine) is not routine:
                raise ProgramError(
                    f"{routine.where}: expected one {routine.name} in a module, got another one"
                )
        elif words.takes("RECORD"):
            name = words.name("the name of a record").lower()
            module.records[name] = _record(words)
        elif words.word in _STORAGES and words.kind == "name":
            declared = _declaration(words, is_local)
            module.data[declared.name.upper()] = declared
        elif is_wrapped:
            words.refuse("data, a routine or ENDMODULE")
        else:
            _statement(words, loose, 0)
    if loose:
        module.routines[""] = RapidRoutine(where, "PROC", "", "", (), tuple(loose), False, True)
    return module


def _record(words: Words) -> tuple[tuple[str, str], ...]:
    fields = []
    while not words.takes("ENDRECORD"):
        kind = words.name("a kind of data or ENDRECORD").lower()
        fields.append(f"{words.name('a component')} {kind}".lower())
        words.require(";", "a semicolon")
    return components(",".join(fields)) if fields else ()


def _declaration(words: Words, is_local: bool) -> DataDeclaration:
    where, storage = words.where, words.advance().upper()
    kind = words.name("a kind of data").lower()
    name = words.name("the name of data")
    extents = words.listed("}") if words.takes("{") else ()
    initial = words.expression() if words.takes(":=") else None
    words.require(";", f"a semicolon behind {name!r}")
    return DataDeclaration(where, storage, kind, name, extents, initial, is_local)


def _routine(words: Words, is_local: bool) -> RapidRoutine:
    where, word = words.where, words.advance().upper()
    kind = words.name("the kind of a function").lower() if word == "FUNC" else ""
    name = words.name("the name of a routine")
    parameters: tuple[Parameter, ...] = ()
    if word != "TRAP":
        words.require("(", "brackets behind the name of a routine")
        parameters = _parameters(words)
    end = _ROUTINE_ENDS[word]
    body = _block(words, (where, word), (end, *_HANDLERS), 0)
    has_handler = False
    while not words.takes(end):
        handler = words.advance().upper()
        if handler == "ERROR" and words.takes("("):
            words.listed(")")
        _block(words, (where, word), (end, *_HANDLERS), 0)
        has_handler = has_handler or handler != "BACKWARD"
    return RapidRoutine(where, word, name, kind, parameters, body, has_handler, is_local)


def _parameters(words: Words) -> tuple[Parameter, ...]:
    parameters: list[Parameter] = []
    while not words.takes(")"):
        if parameters and not words.takes(",", "|") and words.word != "\\":
            words.refuse("a comma or ')' behind a parameter")
        is_optional = words.takes("\\")
        is_reference = words.takes("INOUT", "VAR", "PERS", "REF")
        kind = words.name("the kind of a parameter").lower()
        is_reference = words.takes("VAR", "PERS") or is_reference
        name, rank = words.name("the name of a parameter"), 0
        if words.takes("{"):
            rank = 1
            words.require("*")
            while words.takes(","):
                words.require("*")
                rank += 1
            words.require("}")
        parameters.append(Parameter(name, kind, is_optional, is_reference, rank))
    return tuple(parameters)


def _block(words: Words, opened: tuple[str, str], ends: tuple[str, ...], depth: int) -> Block:
    """Go on by statements up to one of the words that end them.

    Args:
        words: The text.
        opened: Place and word of what they stand in, for the message.
        ends: Words that end them.
        depth: Number of statements that they stand in.
    """
    where, opener = opened
    if depth > _MAX_NESTING:
        raise ProgramError(f"{where}: expected at most {_MAX_NESTING} statements in each other")
    statements: list[Statement] = []
    while words.word not in ends or words.kind != "name":
        if words.kind == "end" or words.word in _CLOSING:
            got = words.written or "the end of the file"
            raise ProgramError(
                f"{where}: expected {opener} to end with {ends[0]}, got {opener} up to {got} in"
                f" {words.where.rsplit(': ', 1)[-1]}"
            )
        _statement(words, statements, depth)
    return tuple(statements)


def _statement(words: Words, statements: list[Statement], depth: int) -> None:
    """Go on by a statement, and add it to those before it."""
    if words.takes(";"):
        return
    if words.kind == "name" and words.next_sign == ":" and words.word != "DEFAULT":
        words.advance()  # a label; what jumps to it is refused
        words.advance()
        return
    where = words.where
    if words.word == "%" and words.kind == "sign":
        words.advance()
        computed = words.expression()
        words.require("%")
        statements.append(RapidInstruction(where, "", words.arguments(), computed))
        words.require(";", "a semicolon")
        return
    if words.kind != "name":
        words.refuse("a statement")
    word = words.word
    if word in _STORAGES:
        statements.append(_declaration(words, True))
    elif word == "IF":
        statements.append(_if(words, where, depth))
    elif word == "FOR":
        statements.append(_for(words, where, depth))
    elif word == "WHILE":
        words.advance()
        condition = words.expression()
        words.require("DO")
        body = _block(words, (where, "WHILE"), ("ENDWHILE",), depth + 1)
        statements.append(While(where, condition, body))
        words.advance()
    elif word == "TEST":
        statements.append(_test(words, where, depth))
    else:
        written = words.written
        statements.append(_simple(words, where))
        words.require(";", f"a semicolon behind {written!r}")


def _simple(words: Words, where: str) -> Statement:
    """Go on by a statement up to its semicolon."""
    if words.takes("RETURN"):
        return Return(where, None if words.word == ";" else words.expression())
    if words.word in ("GOTO", "RAISE", "RETRY", "TRYNEXT"):
        word = words.advance().upper()
        if words.word != ";":
            words.expression()
        return Jump(where, word)
    if words.takes("CONNECT"):
        words.expression()
        words.require("WITH")
        return Connect(where, words.name("the name of a trap"))
    if words.next_sign in (":=", ".", "{"):
        target = words.expression()
        words.require(":=")
        return Assignment(where, target, words.expression())
    return RapidInstruction(where, words.advance(), words.arguments())


def _if(words: Words, where: str, depth: int) -> If:
    words.advance()
    condition = words.expression()
    if not words.takes("THEN"):
        single: list[Statement] = []
        if depth >= _MAX_NESTING:
            words.refuse(f"at most {_MAX_NESTING} statements in each other")
        _statement(words, single, depth + 1)
        return If(where, ((condition, tuple(single)),))
    branches: list[tuple[Expression | None, Block]] = []
    opened, ends = (where, "IF"), ("ENDIF", "ELSE", "ELSEIF")
    branches.append((condition, _block(words, opened, ends, depth + 1)))
    while words.takes("ELSEIF"):
        condition = words.expression()
        words.require("THEN")
        branches.append((condition, _block(words, opened, ends, depth + 1)))
    if words.takes("ELSE"):
        branches.append((None, _block(words, opened, ("ENDIF",), depth + 1)))
    words.require("ENDIF")
    return If(where, tuple(branches))


def _for(words: Words, where: str, depth: int) -> For:
    words.advance()
    name = words.name("the name of a counter")
    words.require("FROM")
    first = words.expression()
    words.require("TO")
    last = words.expression()
    step = words.expression() if words.takes("STEP") else None
    words.require("DO")
    body = _block(words, (where, "FOR"), ("ENDFOR",), depth + 1)
    words.advance()
    return For(where, name, first, last, step, body)


def _test(words: Words, where: str, depth: int) -> Test:
    words.advance()
    value = words.expression()
    opened, ends = (where, "TEST"), ("ENDTEST", "CASE", "DEFAULT")
    _block(words, opened, ends, depth + 1)
    cases: list[tuple[tuple[Expression, ...] | None, Block]] = []
    while not words.takes("ENDTEST"):
        values = None
        if words.takes("CASE"):
            values = words.listed(":")
        else:
            words.require("DEFAULT")
            words.require(":")
        cases.append((values, _block(words, opened, ends, depth + 1)))
    return Test(where, value, tuple(cases))
