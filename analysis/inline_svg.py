"""Figures as SVG within the report: a small fraction of what embedded files take, with text that can be searched and copied.

What matplotlib writes repeats itself: every marker has its definition in every figure, every line its style in words, every corner six
decimals. One page needs each definition and each style once, and places to a hundredth of a point.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass, field
from xml.etree import ElementTree

import matplotlib
from markupsafe import Markup, escape
from matplotlib.figure import Figure

SVG, XLINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}"
# Of markers, clip paths and hatches matplotlib makes the id from the content: equal ids are equal definitions in all figures.
DEFINED_BY_CONTENT = re.compile(r"[mph][0-9a-f]{10}")
REFERENCE = re.compile(r"url\(#([^)]+)\)")
NUMBER = re.compile(r"-?\d+\.\d+(?:e-?\d+)?")
NO_ROTATION = re.compile(r"rotate\(-?0(?:\.0*)?(?:[ ,][^)]*)?\)")
# matplotlib lists a dozen families; these have the same widths (Verdana), so that labels keep their places.
FAMILIES = re.compile(r"'DejaVu Sans'(?:, ?[^;]*)?(?=;|$)")
COMMON = "svg *{stroke-linejoin:round;stroke-linecap:butt}svg text{white-space:pre}"  # the rule that matplotlib puts into each figure, and its spaces


@dataclass
class Page:
    """What the figures of one page share."""

    styles: dict[str, str] = field(default_factory=dict)  # style: its class
    definitions: dict[str, str] = field(default_factory=dict)  # id: element

    def figure(self, figure: Figure, name: str) -> Markup:
        """The figure as an <svg> element; name: what it shows, for who cannot see it."""
        buffer = io.StringIO()
        with matplotlib.rc_context({"svg.fonttype": "none"}):
            figure.savefig(buffer, format="svg", metadata={"Date": None})
        root = ElementTree.fromstring(buffer.getvalue())
        for element in root.iter():
            self._shorten(element)
        for element in root.findall("metadata"):
            root.remove(element)
        self._take_definitions(root)
        _unwrap(root, {reference for element in root.iter() for reference in _references(element)})
        inner = "".join(ElementTree.tostring(child, encoding="unicode") for child in root)
        return Markup(f'<svg viewBox="{root.get("viewBox")}" role="img" aria-label="{escape(name)}">{inner}</svg>')

    @property
    def stylesheet(self) -> Markup:
        return Markup(COMMON + "".join(f".{name}{{{style}}}" for style, name in self.styles.items()))

    @property
    def shared(self) -> Markup:
        """The definitions, as an element without a size; display: none would make clip paths and hatches void."""
        inner = "".join(self.definitions.values())
        return Markup(f'<svg class="shared" width="0" height="0" aria-hidden="true"><defs>{inner}</defs></svg>' if inner else "")

    def _shorten(self, element: ElementTree.Element) -> None:
        element.tag = element.tag.removeprefix(SVG)
        element.text, element.tail = element.text if element.tag == "text" else None, None
        for key in [key for key in element.attrib if key.startswith(XLINK)]:
            element.set(key.removeprefix(XLINK), element.attrib.pop(key))
        for key in ("d", "x", "y", "width", "height", "transform"):
            if key in element.attrib:
                element.set(key, _rounded(element.attrib[key]))
        if not element.get("transform", "x"):
            del element.attrib["transform"]
        if style := element.attrib.pop("style", ""):
            style = FAMILIES.sub("'DejaVu Sans',Verdana,sans-serif", re.sub(r"([:;]) +", r"\1", style))
            # Styles with a reference to a hatch are classes, too: the hatch is one of the page.
            element.set("class", self.styles.setdefault(style, f"s{len(self.styles)}"))

    def _take_definitions(self, root: ElementTree.Element) -> None:
        for parent in list(root.iter()):
            for defs in parent.findall("defs"):
                for element in list(defs):
                    identity = element.get("id", "")
                    if element.tag == "style":
                        defs.remove(element)  # COMMON
                    elif DEFINED_BY_CONTENT.fullmatch(identity):
                        defs.remove(element)
                        self.definitions.setdefault(identity, ElementTree.tostring(element, encoding="unicode"))
                if not len(defs):
                    parent.remove(defs)


def _rounded(words: str) -> str:
    """Places to a hundredth of a point, on one line; scales, which multiply places, as they are."""
    if "scale" in words or "matrix" in words:
        return words
    words = NUMBER.sub(lambda match: f"{float(match.group()):.2f}".rstrip("0").rstrip("."), NO_ROTATION.sub("", words).strip())
    return re.sub(r" ?([A-Za-z]) ?", r"\1", " ".join(words.split())) if words[:1] == "M" else words


def _references(element: ElementTree.Element) -> list[str]:
    named = [element.get("href", "").removeprefix("#")] if element.get("href", "").startswith("#") else []
    return named + [name for value in element.attrib.values() for name in REFERENCE.findall(value)]


def _unwrap(parent: ElementTree.Element, referred: set[str]) -> None:
    """Drops ids that nothing refers to, and groups that then say nothing."""
    children: list[ElementTree.Element] = []
    for child in parent:
        _unwrap(child, referred)
        if child.get("id") not in (None, *referred):
            del child.attrib["id"]
        children += list(child) if child.tag == "g" and not child.attrib else [child]
    parent[:] = children
