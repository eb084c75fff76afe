"""The sidebar of all pages, made of their titles alone.

Every page lists all pages at its side, for which Sphinx copies the contents of each of them, thousands of
functions and classes, and then keeps the titles. Here what it copies are those.
"""

from __future__ import annotations

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


class Sidebar:
    """Lends the titles as contents while the tree of pages is made."""

    def __init__(self) -> None:
        self.titles: dict[str, Any] = {}

    def lend(self, app: Any, name: str, template: str, context: dict[str, Any], *rest: Any) -> None:
        """To a page, before its theme asks for that tree, with titles only."""
        whole = context["toctree"]

        def toctree(**asked: Any) -> Any:
            contents = app.env.tocs
            if asked.get("titles_only"):
                self.titles = self.titles or {k: titles(one) for k, one in contents.items()}
                app.env.tocs = self.titles
            try:
                return whole(**asked)
            finally:
                app.env.tocs = contents

        context["toctree"] = toctree

    def connect(self, app: Any) -> None:
        """Before what themes do, at priority 500."""
        app.connect("html-page-context", self.lend, priority=400)
