"""The sidebar of all pages, made of their titles alone.

Every page lists all pages at its side, for which Sphinx copies the contents of each of them, thousands of
functions and classes, and then keeps the titles. Here what it copies are those.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from sphinx import addnodes


def titles(contents: Any) -> Any:
    """Contents of a page without what is in it but further pages."""
    kept = contents.deepcopy()
    for top in kept.children:
        if len(top) > 1:
            further = list(top.findall(addnodes.toctree))
            if further:
                top[1][:] = further
            else:
                top.pop(1)
    return kept


@cache
def all_titles(env: Any) -> dict[str, Any]:
    """`titles` of every page."""
    return {name: titles(contents) for name, contents in env.tocs.items()}


def lend(app: Any, name: str, template: str, context: dict[str, Any], *rest: Any) -> None:
    """To a page the titles as contents, while its theme has the tree of pages made."""
    whole = context["toctree"]

    def toctree(**asked: Any) -> Any:
        contents = app.env.tocs
        if asked.get("titles_only"):
            app.env.tocs = all_titles(app.env)
        try:
            return whole(**asked)
        finally:
            app.env.tocs = contents

    context["toctree"] = toctree


def connect(app: Any) -> None:
    """Before what themes do, at priority 500; titles are made before processes share out the pages."""
    app.connect("env-check-consistency", lambda app, env: all_titles(env))
    app.connect("html-page-context", lend, priority=400)
