"""How ``make docs`` builds the site: Sphinx over this folder's pages; nothing is loaded from elsewhere."""

from __future__ import annotations

from typing import Any

from docutils import nodes

import fogml
from fogml.cli.docs_job import mathml

project = "fogml"
author = "The fogml authors"
copyright = author
version = release = fogml.__version__
extensions = ["myst_parser", "numpydoc", "sphinx.ext.autodoc"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build"]
nitpicky = False

# The same text is read on a forge, by Sphinx and by `fogml docs`: CommonMark, tables, fences of math.
myst_fence_as_directive = ["math"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "none"
autosummary_generate = False
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

html_theme = "furo"
html_title = f"fogml {release}"
html_static_path = ["_static"]
html_css_files = ["fogml.css"]
html_copy_source = False
html_show_sourcelink = False
html_math_renderer = "mathml"
html_theme_options: dict[str, Any] = {"footer_icons": []}


def _block(writer: Any, node: nodes.math_block) -> None:
    writer.body.append(mathml(node.astext()))
    raise nodes.SkipNode


def _inline(writer: Any, node: nodes.math) -> None:
    writer.body.append(f"<code>{writer.encode(node.astext())}</code>")
    raise nodes.SkipNode


def _add_options(app: Any, docname: str, source: list[str]) -> None:
    """The page of all options ends with them, as the commands declare them."""
    if docname == "options":
        from fogml.cli.docs_job import options_page

        source[0] += options_page()


def setup(app: Any) -> dict[str, bool]:
    """Formulas as MathML, which browsers draw themselves; options from the commands."""
    app.add_html_math_renderer("mathml", block_renderers=(_block, None), inline_renderers=(_inline, None))
    app.connect("source-read", _add_options)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
