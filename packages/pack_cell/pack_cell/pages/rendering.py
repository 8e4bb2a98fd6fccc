"""Templates to self-contained pages; every value is escaped unless it is markup of our own."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup


def source(path: str) -> Markup:
    """The text of a file of this package, such as ``pages/style.css``, to stand in a page as is."""
    return Markup(files('pack_cell').joinpath(path).read_text(encoding='utf-8'))


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=FunctionLoader(source),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals['source'] = source
    return environment


def render(template: str, **values: Any) -> str:  # noqa: ANN401 - whatever the template shows
    """The page that ``template``, a path in this package, makes of ``values``."""
    return _environment().get_template(template).render(**values)
