"""plotly.js with what a page draws, and little more: the browser has to read all that there is.

plotly.js is one file of modules, each in a function that runs when another one asks for it,

    var name = wrap((exports, module) => {...});     name()

and the last one registers all kinds of traces that it can draw.  With those alone that a page has,
most modules are asked for by none, and are left out.  The licence at the head stays.
"""

from __future__ import annotations

import re
from functools import cache
from itertools import pairwise

from plotly.offline import get_plotlyjs

# No part of a name is tried as a name again.
_NAME = r"[A-Za-z0-9_$]++"
_REGISTERED = re.compile(rf"\.register\(\[({_NAME}\(\)(?:,{_NAME}\(\))*)\]\)")
_LAST = re.compile(rf"return ({_NAME})\(\);?\}}\)\(\);")
_REQUIRED = re.compile(rf"({_NAME})\(\)")
_PASSED_ON = re.compile(rf"exports=({_NAME})\(\)\}}\);$")
_TRACE = re.compile(r'moduleType:"trace",name:"(\w+)"')
_COMPONENT = 'moduleType:"component"'
# What the core draws without being asked.
_CORE = frozenset({"scatter"})


@cache
def plotly_js(kinds: frozenset[str]) -> str:
    """Return plotly.js for figures of some kinds of traces.

    It is the whole one where the installed one is built in another way.

    Example:
        >>> len(plotly_js(frozenset({"scatter"}))) < len(get_plotlyjs())
        True
    """
    whole = get_plotlyjs()
    return _without_the_rest(whole, kinds - _CORE) or whole


def _without_the_rest(whole: str, kinds: frozenset[str]) -> str | None:
    """Return the reduced source, or None if it is not built as described above."""
    registered = [*_REGISTERED.finditer(whole)]
    last = _LAST.search(whole, registered[-1].end()) if registered else None
    if last is None:
        return None
    wrap = re.search(rf"var {re.escape(last[1])}=({_NAME})\(", whole)
    if wrap is None:
        return None
    starts = [*re.finditer(rf"var ({_NAME})={re.escape(wrap[1])}\(", whole)]
    bounds = [*(match.start() for match in starts), last.start()]
    modules = {
        match[1]: whole[start:end]
        for match, (start, end) in zip(starts, pairwise(bounds), strict=True)
    }
    if not all(text.endswith("});") for text in modules.values()):
        return None
    every = registered[-1][1]
    traces = {name: _kind(name, modules) for name in _REQUIRED.findall(every)}
    if not kinds <= set(traces.values()):
        return None
    needed_traces = [name for name, kind in traces.items() if kind in kinds or kind == _COMPONENT]
    modules[last[1]] = modules[last[1]].replace(
        every, ",".join(f"{name}()" for name in needed_traces)
    )
    head = whole[: bounds[0]]
    required = _required(head + f"{last[1]}()", modules)
    return (
        head
        + "".join(modules[name] for name in modules if name in required)
        + whole[last.start() :]
    )


def _kind(name: str, modules: dict[str, str]) -> str | None:
    """Return the kind of trace that a registered module, or the one it passes on, draws."""
    while name in modules:
        text = modules[name]
        if trace := _TRACE.search(text):
            return trace[1]
        if _COMPONENT in text:
            return _COMPONENT
        further = _PASSED_ON.search(text)
        if further is None:
            return None
        name = further[1]
    return None


def _required(text: str, modules: dict[str, str]) -> set[str]:
    """Return the modules that a text asks for, directly or through others."""
    required_texts: set[str] = set()
    texts = [text]
    while texts:
        required = {
            name for name in _REQUIRED.findall(texts.pop()) if name in modules
        } - required_texts
        required_texts |= required
        texts += [modules[name] for name in required]
    return required_texts
