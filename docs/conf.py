"""The site, built by `make docs`. Sphinx reads from the root, so that a page's links hold on the
site as they do in the repository."""

import json
import os
import re
import sys
from base64 import b64decode
from enum import Enum
from inspect import getdoc
from pathlib import Path
from types import FunctionType

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from pydantic import BaseModel
from sphinx.errors import SphinxError
from sphinx.ext.napoleon import GoogleDocstring

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "properties"))

from public_names import docstring, exports, homes, is_constant  # noqa: E402

project = "bolfi-liquids"
copyright = "its authors, Apache-2.0"
root_doc = "docs/index"
include_patterns = ["*.md", "docs/**.md", "bolfi_liquids/guide/*.md", "notebooks/*.ipynb"]
exclude_patterns = [".*", "build", "dist", "runs", "docs/_build"]
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
]
nitpicky = True
suppress_warnings = ["ref.python"]  # two packages have a `Rig`; annotations name the robot's
smartquotes_action = "D"  # dashes alone
highlight_language = "none"

html_theme = "furo"
html_title = project
html_math_renderer = "mathml"
html_copy_source = False
html_static_path = html_css_files = ["site.css"]
copybutton_prompt_text = r">>> |\.\.\. "
copybutton_prompt_is_regexp = True

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = "force" if os.environ.get("NOTEBOOKS") else "off"
nb_execution_excludepatterns = ["*paper_figures*"]  # it shows what hours of `make paper` drew
nb_execution_timeout = -1
nb_execution_raise_on_error = True
os.environ.setdefault("PYTHONWARNINGS", "ignore:IProgress not found")  # tqdm's, in each kernel
nb_ipywidgets_js = {}  # they would come from elsewhere

add_module_names = False
autosummary_generate = False
autodoc_default_options = {"members": True, "special-members": "__call__"}
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 140
napoleon_numpy_docstring = False
napoleon_attr_annotations = False  # the signature has them

EXPORTS, HOMES = exports(), homes()
FOREIGN = "collections|concurrent|contextlib|jax|numpy|numpyro|os|pathlib|xarray"
nitpick_ignore_regex = [  # classes in annotations: of other projects, in quotes, not public
    ("py:class", rf"({FOREIGN})\..*|tuple\[.*"),
    ("py:class", "ArrayLike|Axes|DataTree|Dataset|Distribution|NDArray|Path|ValidationError"),
    ("py:class", "PivotPath|PourSummary"),
    ("py:class", rf"(?!({'|'.join(EXPORTS)})\.\w+$)bolfi_liquids\..*"),
]
ENTRIES = {f"{home}.{name}": EXPORTS[home][name] for home, name in HOMES.values()}
GUIDE = "bolfi_liquids/guide"
CODE = re.compile(r"(?<!`)`([^`]+)`(?!`)")
COMMAND = re.compile(r"bolfi-liquids guide (\w+)")
SOUGHT = {  # page of the guide -> heading -> entries of the index, which the search finds first
    f"{GUIDE}/simulator": {
        "## Budget": "! until",
        "## Parameters": "! hierarchical model",
        "### A constraint": "! constraint, ! inequality, ! simplex",
        "## Cheap runs beside expensive ones": "! multi-fidelity, ! multifidelity",
        "## Noise": "! noise",
        "## Sampling and checks": "! confidence interval, ! credible interval",
        "### Which of two simulators?": "! model comparison, ! evidence, ! Bayes factor",
        "### Your own discrepancy": "! own discrepancy, ! custom discrepancy, ! custom distance",
    },
    f"{GUIDE}/priors": {"## Ending early": "! until"},
    f"{GUIDE}/program": {"## The command": "! external program, ! subprocess"},
    f"{GUIDE}/criticism": {"## In your own simulator": "! add effect"},
}
TEMPLATE = "`bolfi-liquids rig template`"
DEFAULT = re.compile(r"(?<== )_?[A-Z][A-Z_]+\b")  # a number by its name
STAR = re.compile(r"(?<!\*)\*(?!\*)")  # two are napoleon's


def draw_gallery(app):
    """Figures of the notebooks as they are committed, for the front page: NOTEBOOK-1.png first."""
    folder = ROOT / "docs" / "_build" / "gallery"
    folder.mkdir(parents=True, exist_ok=True)
    for path in (ROOT / "notebooks").glob("*.ipynb"):
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        outputs = (output.get("data", {}) for cell in cells for output in cell.get("outputs", ()))
        figures = (data["image/png"] for data in outputs if "image/png" in data)
        for number, figure in enumerate(figures, start=1):
            (folder / f"{path.stem}-{number}.png").write_bytes(b64decode(figure))


def adapt(app, docname, source):
    """A guide page's commands that show a page or a template become links, and its headings entries
    of the index; README is "Overview"; a package's name may break at its dots."""
    if docname.startswith(GUIDE):
        source[0] = re.sub(f"`{COMMAND.pattern}`", r"[\g<0>](\1.md)", source[0])
        source[0] = source[0].replace(TEMPLATE, f"[{TEMPLATE}](/docs/rig.md)")
    for heading, entries in SOUGHT.get(docname, {}).items():
        before, after = source[0].split(f"\n{heading}\n")  # raises where there is none
        source[0] = f"{before}\n```{{index}} {entries}\n```\n\n{heading}\n{after}"
    if docname == "README":
        source[0] = source[0].replace(f"# {project}\n", "# Overview\n", 1)
    if docname.startswith("docs/api/"):
        title, rest = source[0].split("\n", 1)
        source[0] = title.replace(".", ".\u200b") + f"\n{rest}"


def skip(app, what, name, obj, skipped, options):
    """An object has its entry in one package, a NamedTuple's field in the class's docstring."""
    home = HOMES.get(id(obj)) if what == "module" else None
    elsewhere = home and home[0] != app.env.current_document.autodoc_module
    if elsewhere or type(obj).__name__ == "_tuplegetter":
        return True
    return False if isinstance(obj, Enum) and not name.startswith("_") else None


def describe(app, what, name, obj, options, lines):
    """A docstring in which names in backticks are code, and links where they have an entry."""
    if what == "property" and obj.__doc__:  # napoleon would read a type and no sections
        lines[:] = GoogleDocstring(getdoc(obj), app.config, app, "method", name, obj).lines()
    if what == "data":
        lines[:] = docstring(name.rpartition(".")[2], obj).splitlines()
    package = max((one for one in EXPORTS if f"{name}.".startswith(f"{one}.")), key=len)
    if what == "module":
        lines[1:] = _contents(package)  # what follows the first line is for developers
    arguments = re.findall(r"^:param (\w+):", "\n".join(lines), re.M)
    lines[:] = [_marked(line, package, arguments) for line in lines]


def _contents(package):
    """A package's names, each linked to its entry; entries of constants, which autodoc leaves out:
    it looks for their docstrings in the package, and they stand where a constant is defined."""
    yield from ("", ".. highlight:: pycon", "", ".. autosummary::", "   :nosignatures:", "")
    for value in EXPORTS[package].values():
        home, name = HOMES[id(value)]
        yield f"   {name if home == package else f'~{home}.{name}'}"
    for name, value in EXPORTS[package].items():
        if is_constant(value):
            yield from ("", f".. py:data:: {name}", "")
            yield from (f"   {line}" for line in docstring(name, value).splitlines())


def _marked(line, package, arguments):
    if line.lstrip().startswith((">>> ", "... ")):
        return line
    parts = CODE.split(line)
    parts[::2] = [STAR.sub(r"\\*", text) for text in parts[::2]]
    parts[1::2] = [_code(text, "" if text in arguments else package) for text in parts[1::2]]
    return "".join(parts)


def _code(text, package):
    """A link where a page of the guide is meant, or an entry of the package or of one above it."""
    if page := COMMAND.fullmatch(text):
        return f":doc:`{text} </{GUIDE}/{page[1]}>`"
    while package:
        full = f"{package}.{text}"
        owner, _, member = full.rpartition(".")
        found = getattr(ENTRIES.get(owner), member, None)
        if full in ENTRIES or full in EXPORTS or isinstance(found, FunctionType | property):
            return f":py:obj:`{text} <{full}>`"
        package = package.rpartition(".")[0]
    return f"``{text}``"


def sign(app, what, name, obj, options, *signed):
    """Without fields of a file's model, of which the guide has the table; constants by value."""
    if what == "class" and issubclass(obj, BaseModel):
        return "", None
    signature, returned = signed
    constants = vars(sys.modules.get(getattr(obj, "__module__", None), object))
    spelt = DEFAULT.sub(lambda found: repr(constants.get(found[0], found[0])), signature or "")
    return (spelt, returned) if signature else None


def visit_math(self, node):
    """MathML, which browsers show without a script."""
    self.body.append(tex2mathml(node.astext(), as_block=isinstance(node, nodes.math_block)))
    raise nodes.SkipNode


def finish(app, error):
    """The site's address shows its front page. A public name without an entry is an error."""
    page = '<meta http-equiv="refresh" content="0; url=docs/index.html">\n'
    (Path(app.outdir) / "index.html").write_text(page, encoding="utf-8")
    if missing := ENTRIES.keys() - app.env.domains.python_domain.objects.keys():
        raise SphinxError(f"no page of docs/api has {', '.join(sorted(missing))}")


def setup(app):
    app.add_html_math_renderer("mathml", (visit_math, None), (visit_math, None))
    app.connect("builder-inited", draw_gallery)
    app.connect("source-read", adapt)
    app.connect("autodoc-skip-member", skip)
    app.connect("autodoc-process-docstring", describe, priority=600)  # after napoleon
    app.connect("autodoc-process-signature", sign)
    app.connect("build-finished", finish)
