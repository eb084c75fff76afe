"""Sphinx configuration."""

import importlib.util
import os
import pkgutil
import re
import shutil
import sys
import types
from pathlib import Path

import numpydoc.docscrape_sphinx
from jinja2.sandbox import SandboxedEnvironment

import microslip

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_scripts"), str(HERE.parent / "tools")]

import api_pages  # noqa: E402
import floors  # noqa: E402
import input_reference  # noqa: E402
import pictures  # noqa: E402
import sidebar  # noqa: E402
from sphinx import addnodes  # noqa: E402
from sphinx.util import logging  # noqa: E402

# Here once, and not again in every process that reads pages.
for module in pkgutil.walk_packages(microslip.__path__, "microslip."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)

# Made from the package itself at every build, so that they cannot be out of date.
floors.draw(HERE / "images" / "generated" / "floors.svg")
api_pages.write(HERE / "api")
input_reference.write(HERE / "input-reference.md")

project = "microslip"
author = "The microslip developers"
copyright = author
release = version = microslip.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "numpydoc",
]
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "evidence", "_scripts", "**/.ipynb_checkpoints"]

autosummary_generate = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"
numpydoc_show_class_members = False
# One environment for all docstrings: with one each, their template was compiled eight thousand times.
docstring_environment = SandboxedEnvironment()


def one_environment(loader):
    """Stands for numpydoc's own; all of its loaders read the same templates."""
    docstring_environment.loader = docstring_environment.loader or loader
    return docstring_environment


numpydoc.docscrape_sphinx.SandboxedEnvironment = one_environment
numpydoc_xref_param_type = True
numpydoc_xref_aliases = {
    "sequence": "collections.abc.Sequence",
    "iterable": "collections.abc.Iterable",
    "mapping": "collections.abc.Mapping",
    "bool": "bool",
    "boolean": "bool",
} | {
    name: f"microslip.{home}.{name}"
    for name, home in microslip._HOME.items()
    if name[0].isupper() and not name.isupper()
}
numpydoc_xref_ignore = {
    "optional",
    "of",
    "or",
    "to",
    "by",
    "array",
    "arrays",
    "sequence",
    "mapping",
    "callable",
    "tuple",
    "pair",
    "complex",
    "int8",
    "sparse",
    "function",
    "default",
    "None",
}

# Tutorials run in the interpreter that builds, with its commands.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 600
nb_execution_in_temp = True
nb_merge_streams = True
os.environ["PATH"] = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
os.environ.update(TERM="dumb", COLUMNS="84")

# Nothing is fetched from outside: MathJax is copied beside the pages, and needs no fonts.
MATHJAX = Path(*importlib.util.find_spec("sphinx-mathjax-offline").submodule_search_locations)
mathjax_path = "mathjax/tex-svg.js"

html_theme = "furo"
html_title = f"microslip {release}"
html_static_path = ["_static"]
html_css_files = ["wide.css"]


def keep_equations(app, what, name, obj, options, lines):
    """Show the indented equations of docstrings as they are written.

    An indented block that follows a blank line and unindented text is an equation, not a quotation.
    Elsewhere bars are absolute values, not markup.
    """
    kept = []
    last, blank, inside = "", True, False
    for line in lines:
        indented = line.startswith("    ")
        starts = indented and blank and bool(last) and not last.startswith(" ")
        if starts and not last.endswith("::"):
            kept += [".. code-block:: none", ""]
        inside = starts or (inside and (indented or not line.strip()))
        literal = inside or line.lstrip().startswith((">>>", "..."))
        kept.append(line if literal else escape_bars(line))
        blank = not line.strip()
        last = line if line.strip() else last
    lines[:] = kept


def escape_bars(line):
    """Escape ``|`` outside of literals."""
    parts = re.split(r"(``.*?``)", line)
    return "".join(p if p.startswith("``") else p.replace("|", r"\|") for p in parts)


def skip_members(app, what, name, obj, skip, options):
    """Leave out what pydantic adds to every model, and aliases of types, which have no signature."""
    alias = isinstance(obj, types.GenericAlias | types.UnionType | type(list[int]))
    return True if name == "model_config" or alias else None


def shorten_contents(app, doctree):
    """Contents list modules, functions and classes, and not each attribute: every page carries them all."""
    for node in doctree.findall(addnodes.desc):
        if node["objtype"] in {"attribute", "method", "property"}:
            node["no-contents-entry"] = True


def bundle_mathjax(app, error):
    """Copy what the pages need of MathJax: one file, and the extensions of TeX that it may load."""
    if error is None and app.builder.format == "html":
        source, target = MATHJAX / "static" / "mathjax", Path(app.outdir) / "_static" / "mathjax"
        for part in ("input/tex/extensions", "a11y"):
            shutil.copytree(source / part, target / part, dirs_exist_ok=True)
        shutil.copy(source / "tex-svg.js", target)


def name_stale_pictures(app):
    """A picture older than what it shows is a warning; one not drawn since stamps are kept, a note."""
    log = logging.getLogger(__name__)
    for name, why in pictures.stale().items():
        say = log.info if why == pictures.UNSTAMPED else log.warning
        say(f"docs/images: {name}: {why}; make pictures")


def setup(app):
    """Run before what numpydoc and Sphinx do at the same events, at priority 500."""
    app.connect("autodoc-process-docstring", keep_equations, priority=400)
    app.connect("autodoc-skip-member", skip_members)
    app.connect("doctree-read", shorten_contents, priority=400)
    app.connect("builder-inited", name_stale_pictures)
    sidebar.connect(app)
    app.connect("build-finished", bundle_mathjax)
