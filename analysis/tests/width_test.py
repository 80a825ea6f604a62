"""Every kind of figure in a column of a page with two, and on a whole page: all words lie within it, none on another, in letters of a
readable size."""

from __future__ import annotations

from pathlib import Path
from typing import Callable, Iterator

import matplotlib
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from .. import __main__ as program
from .. import figures, fitting, lint_figures, sidecars, style
from ..commands.pages import INCH, NARROWEST, WIDEST
from ..comparison import Analysis
from ..figures import hypotheses, ladder, numerics, pareto, schedules, strategy_map, weak, work
from ..figures.common import Drawing
from . import compilers_test, ladder_test, lint_folders_test, synthetic, work_test
from .conftest import analyse
from .hypotheses_test import state
from .ladder_test import STEPS
from .trade_test import plain  # noqa: F401  a fixture
from .weak_test import written  # noqa: F401  a fixture
from .work_test import growing  # noqa: F401  a fixture

WIDTHS = (NARROWEST, WIDEST)
EDGE = 0.02  # inches by which the box of a word may pass the edge: it is higher and wider than its letters


def words_of(figure: Figure) -> list[tuple[str, Text]]:
    """All words but those of axes, where points and their names have places of their own."""
    found = [(words.get_text(), words) for words in figure.texts]
    for axes in figure.axes:
        if not axes.axison:
            continue
        labels = [axes.xaxis.label, axes.yaxis.label, axes.title, axes._left_title, axes._right_title]
        # Ticks beyond the ends of an axis exist, and are not drawn.
        ticks = [tick.label1 for axis in (axes.xaxis, axes.yaxis) for tick in axis.get_major_ticks()
                 if min(axis.get_view_interval()) <= tick.get_loc() <= max(axis.get_view_interval())]
        found += [(words.get_text(), words) for words in [*labels, *ticks] if words.get_visible()]
    for legend in figure.legends:
        found += [(words.get_text(), words) for words in legend.get_texts()]
    return [(said, words) for said, words in found if said.strip()]


def crowded(figure: Figure) -> list[str]:
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    width, height = figure.get_size_inches()

    def box_of(words: Text) -> tuple[float, float, float, float]:
        box = words.get_window_extent(canvas.get_renderer())
        return box.x0 / figure.dpi, box.y0 / figure.dpi, box.x1 / figure.dpi, box.y1 / figure.dpi

    beside = [(words.get_text(), words) for axes in figure.axes for words in axes.texts if not words.get_clip_on()]
    boxes = [(said, box_of(words), words.get_rotation() % 90 != 0) for said, words in words_of(figure)]
    faults = [f"{said!r} leaves the figure" for said, (x0, y0, x1, y1) in [*((s, b) for s, b, _ in boxes), *((s, box_of(w)) for s, w in beside)]
              if said.strip() and (x0 < -EDGE or y0 < -EDGE or x1 > width + EDGE or y1 > height + EDGE)]
    for i, (a, (ax0, ay0, ax1, ay1), tilted) in enumerate(boxes):
        for b, (bx0, by0, bx1, by1), other in boxes[i + 1:]:
            if not tilted and not other and ax0 < bx1 - EDGE and bx0 < ax1 - EDGE and ay0 < by1 - EDGE and by0 < ay1 - EDGE:
                faults.append(f"{a!r} lies on {b!r}")
    return faults


def check(drawings: list[Drawing], width: float) -> None:
    assert drawings
    for drawing in drawings:
        faults = crowded(drawing.figure)
        assert not faults, f"{drawing.name}: {'; '.join(faults)}"
        wide, high = drawing.figure.get_size_inches()
        assert wide <= width / INCH + 0.02 and high <= style.MAX_HEIGHT + 0.8, (drawing.name, wide, high)
        assert sidecars.smallest_text(drawing.figure) >= lint_figures.SMALLEST_TEXT, drawing.name


def drawn(analysis: Analysis, width: float, modules=figures.MODULES) -> list[Drawing]:
    with style.page(width / INCH), matplotlib.rc_context(style.RC):
        return [drawing for module in modules for drawing in module.draw(analysis)]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Analysis:
    return analyse(synthetic.write(tmp_path_factory.mktemp("whole")))


@pytest.mark.parametrize("width", [*WIDTHS, 122])
def test_a_whole_study(whole: Analysis, width: float) -> None:
    check(drawn(whole, width), width)


@pytest.fixture
def claimed(study: Callable[..., Path]) -> Path:
    claim = "On the mesh the fused frame beats every strategy that stores its triangles first, by more than what is said here"
    folder = study()
    fast, slow = (next(r.name for r in analyse(folder).study.timed if r.config.kernel == kernel) for kernel in ("tile_parallel", "bounding_box"))
    state(folder, {"claim": claim, "by": 0.1, "faster": [fast], "slower": [slow], "untested": None})
    return folder


@pytest.fixture
def climbing(study: Callable[..., Path]) -> Path:
    return study(untimed=False, edit=ladder_test.of(STEPS))


@pytest.fixture
def grid(study: Callable[..., Path]) -> Path:
    return work_test.write_grid(study)


OTHERS = {"claimed": (hypotheses,), "climbing": (ladder, schedules), "grid": (strategy_map,), "growing": (work,), "written": (weak, work)}


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("kind", OTHERS)
def test_other_studies(kind: str, width: float, request: pytest.FixtureRequest) -> None:
    check(drawn(analyse(request.getfixturevalue(kind)), width, OTHERS[kind]), width)


@pytest.mark.parametrize("width", WIDTHS)
def test_speed_against_accuracy(plain, width: float) -> None:  # noqa: F811
    check(drawn(plain, width, (pareto, numerics)), width)


@pytest.fixture
def taken(monkeypatch: pytest.MonkeyPatch) -> list[Drawing]:
    """The figures that a command writes."""
    found: list[Drawing] = []
    files = sidecars.files

    def keep(drawing: Drawing, *rest: str) -> dict[str, bytes]:
        found.append(drawing)
        return files(drawing, *rest)

    monkeypatch.setattr(sidecars, "files", keep)
    return found


def commands(folder: Path) -> Iterator[list[str]]:
    """Those that draw something else than a study."""
    for name, write in lint_folders_test.WRITERS.items():
        (folder / name).mkdir()
        source, _ = write(folder / name)
        out = {"adopt": [], "trace": ["--out", str(folder / "trace" / "drawn")], "stability": [], "whatif": ["--out", str(folder / "whatif" / "drawn")]}[name]
        yield [name, str(source.parent if name == "adopt" else source), *out]
    yield ["compilers", str(compilers_test.folder_of(folder / "compilers"))]
    few = synthetic.plan(scenes={"teapot": synthetic.SCENES["teapot"]}, kernels=["tile_parallel", "triangle_atomics"], threads=[1, 2])
    runs = [str(synthetic.write(folder / name, few)) for name in ("a", "b")]
    yield ["compare", *runs, "--few-launches", "-o", str(folder / "compared")]


@pytest.mark.parametrize("width", WIDTHS)
def test_other_commands(width: float, tmp_path: Path, taken: list[Drawing]) -> None:
    for arguments in commands(tmp_path):
        taken.clear()
        program.main([*arguments, "--width", str(width)])
        check(taken, width)


@pytest.mark.parametrize("width", ["83", "176", "0", "-84", "nan", "wide"])
def test_other_widths_are_refused(width: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        program.main(["report", str(tmp_path), "--width", width])
    said = capsys.readouterr().err
    assert end.value.code == 2 and said.count("\n") == 1 and "--width" in said


def test_lines_keep_the_words_and_the_breaks() -> None:
    said = "the time of a frame\nover that of the base, log scale"
    broken = fitting.lines(said, 8, 1.2)
    assert broken.split() == said.split() and "frame\nover" in broken
    assert all(style.text_width([line], 8) <= 1.2 for line in broken.split("\n"))
    assert fitting.lines("openmp_dynamic_with_a_long_name", 8, 0.5) == "openmp_dynamic_with_a_long_name"  # one word is never broken


def test_a_page_lasts_as_long_as_its_block() -> None:
    with pytest.raises(ZeroDivisionError), style.page(4):
        assert style.page_width() == 4
        raise ZeroDivisionError
    assert style.page_width() == style.FULL_WIDTH
