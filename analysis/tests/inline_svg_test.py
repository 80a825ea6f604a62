"""The figures of the report as one page: what repeats itself is there once, and what is drawn stays where it was."""

from __future__ import annotations

import io
import re
from xml.etree import ElementTree

import matplotlib
import pytest
from matplotlib.figure import Figure

from .. import inline_svg, style


def drawn(label: str = "a < b") -> Figure:
    with matplotlib.rc_context(style.RC):
        figure = style.new_figure(3, 2)
        axes = style.place(figure, 0.5, 0.5, 2, 1.2)
        axes.plot([1, 2, 3], [1.23456789, 2, 1], marker="o", label=label)
        axes.bar([1, 2], [1, 1], hatch="//")
        axes.set_xlabel(label)
        figure.legend()
    return figure


def made(page: inline_svg.Page, figure: Figure) -> str:
    with matplotlib.rc_context(style.RC):
        return str(page.figure(figure, 'a "name"'))


def test_a_figure_is_one_element_that_says_its_name() -> None:
    root = ElementTree.fromstring(made(inline_svg.Page(), drawn()))
    assert root.tag == "svg" and root.get("viewBox") == "0 0 216 144" and root.get("aria-label") == 'a "name"'


def test_text_is_text() -> None:
    assert [text.text for text in ElementTree.fromstring(made(inline_svg.Page(), drawn())).iter("text")].count("a < b") == 2


def test_an_equal_figure_adds_no_definition_and_no_style() -> None:
    page = inline_svg.Page()
    made(page, drawn())
    before = page.stylesheet, page.shared
    made(page, drawn("another label"))
    assert (page.stylesheet, page.shared) == before


def test_every_reference_and_class_is_defined() -> None:
    page = inline_svg.Page()
    figures = made(page, drawn()) + made(page, drawn("b"))
    whole = figures + str(page.shared) + str(page.stylesheet)
    referred = set(re.findall(r'url\(#([^)]+)\)|href="#([^"]+)"', whole))
    assert referred and {a or b for a, b in referred} <= set(re.findall(r' id="([^"]+)"', whole))
    used = {name for value in re.findall(r'class="([^"]+)"', figures + str(page.shared)) for name in value.split()} - {"shared"}
    assert used == set(re.findall(r"\.(s\d+)\{", str(page.stylesheet)))


def test_places_are_kept_to_a_hundredth_of_a_point() -> None:
    """Against what matplotlib writes: as many paths, and every number of each within half a hundredth."""
    figure = drawn()
    page = inline_svg.Page()
    short = made(page, figure) + str(page.shared)
    buffer = io.StringIO()
    with matplotlib.rc_context(style.RC | {"svg.fonttype": "none"}):
        figure.savefig(buffer, format="svg")
    numbers = [[[float(x) for x in re.findall(r"-?\d+\.?\d*", path)] for path in re.findall(r' d="([^"]*)"', source)] for source in (short, buffer.getvalue())]
    key = lambda path: (len(path), [round(x, 1) for x in path])
    for ours, theirs in zip(*(sorted(paths, key=key) for paths in numbers), strict=True):
        assert ours == pytest.approx(theirs, abs=0.0051)


def test_it_is_smaller() -> None:
    figure = drawn()
    with matplotlib.rc_context(style.RC):
        whole = style.outputs(figure)["svg"]
    page = inline_svg.Page()
    made(page, figure)
    assert len(made(page, figure)) < len(whole) / 4  # the second of its like
