"""What the trade between speed and accuracy amounts to, in sentences that are made from the fronts and from nothing else."""

from __future__ import annotations

from . import fronts as measures
from . import comparison, text, trade
from .comparison import Analysis
from .fronts import LITERAL, Front, Mark
from .trade import Picture, Trade, View

ALL = 40  # names are never cut off with "and n more": a mode that is not named is not reported


def base(whole: Trade, view: View) -> str:
    """Which point speedups refer to, with its seconds."""
    config = view.bases[0].config
    seconds = text.listing([f"{text.number(whole.analysis.estimates[b.id].value / 1000)} s" for b in view.bases], ALL)
    if not whole.is_literal(view.bases[0]):
        return f"Base: {config.numeric} ({seconds}), because the literal program was not timed."
    rules = "".join(f", {axis} {getattr(config, axis)}" for axis in ("fill", "near")
                    if getattr(config, axis) != view.pictures[0].axis(axis))
    first = trade.LITERAL_KERNELS[0]
    other = "" if config.kernel == first else f"; {first}, which visits every pixel as the text says, is not the base here"
    return f"Base: the literal program, {config.numeric} with {config.kernel}, serial{rules}: {seconds}{other}."


def points(view: View) -> str:
    """Which point each mode stands for."""
    if view.one_loop:
        config = next(iter(view.modes.values()))[0].config
        return f"All modes in {config.kernel}, {comparison.execution(config)}: only the arithmetic differs."
    if view.several:
        return "Each mode stands for the one kernel and execution that is its fastest over these scenes; see tables/trade_over_scenes.csv."
    return f"Each mode stands for its fastest timed point; see tables/trade_{view.slug}.csv."


def frontier(front: Front) -> list[str]:
    """Who is on the line."""
    line = text.listing([f"{m.name} ({front.measure.said(m.error)}{', no bound' if m.unbounded else ''})" for m in front.frontier], ALL)
    said = [f"by {front.measure.noun}, on the frontier: {line}."]
    if any(mark.unbounded for mark in front.frontier):
        said.append(f"Of the modes with a bound: {text.listing([m.name for m in front.bounded_frontier], ALL) or 'none'}.")
    return said


def rest(front: Front) -> list[str]:
    """Who is not on the line."""
    said = []
    loose = {mark.name for mark in front.marks if mark.unbounded}
    if front.dominated:
        by: dict[str, list[str]] = {}
        for mode, better in front.dominated.items():
            by.setdefault(better + (" (no bound)" if better in loose else ""), []).append(mode)
        said.append("Dominated: " + "; ".join(f"{text.listing(modes, ALL)} by {better}" for better, modes in by.items()) + ".")
    if front.open:
        said.append(f"Not told apart from the frontier: {text.listing(front.open, ALL)}.")
    return said


def left_out(whole: Trade, picture: Picture) -> list[str]:
    """Modes that a picture has but its figure cannot show, with the reason."""
    entries, notes = whole.entries(picture), []
    said = [f"{mode} ({record.status}: {text.shorten(record.reason, 80)})" for mode, record in entries.items() if not record.ok]
    if said:
        notes.append(f"Without a speed: {text.listing(said, ALL)}.")
    unseen = [mode for mode, record in entries.items() if record.ok and measures.WRONG.of(record) is None]
    if unseen:
        notes.append(f"Not judged against the oracle, which needs the screen triangles of a mode: {text.listing(unseen, ALL)}.")
    return notes


def summary(analysis: Analysis) -> list[str]:
    """The paragraphs at the head of the section."""
    whole = trade.of(analysis)
    if not whole.pictures:
        return []
    modes = list(dict.fromkeys(mode for picture in whole.pictures for mode in whole.entries(picture)))
    said = [f"{text.count(len(modes), 'numeric mode')} on {text.listing([p.title for p in whole.pictures], ALL)}. The oracle counts a"
            " pixel as wrong if exact arithmetic on the screen triangles that the mode was given finds another owner; end to end the"
            " judge starts from the numbers in the files. The frontier holds the modes that no other mode equals in both speed and"
            " errors; a mode is called dominated if one on the frontier has at most its errors and the times show that it is faster, or"
            f" if it has fewer and the times show that it is not slower by more than {text.percent(analysis.study.target)}."]
    for view in [view for view in whole.over_scenes if whole.fronts(view)] or whole.views():
        fronts = whole.fronts(view)
        for front in fronts:
            only = front is fronts[0]
            said.append(" ".join([_place(view), *frontier(front), *(rest(front) + _worst(front) + [points(view)] if only else [])]))
        if lost := _everywhere(fronts):
            said.append(f"{_place(view)} dominated by all of these measures: {text.listing(lost, ALL)}.")
    loose = list(dict.fromkeys(m for p in whole.pictures for m, r in whole.entries(p).items() if measures.unbounded(r)))
    if loose:
        said.append(f"Without a bound: {text.listing(loose, ALL)}. What {'they show' if len(loose) > 1 else 'it shows'} here says nothing"
                    " of another scene.")
    missing: dict[str, list[str]] = {}
    for picture in whole.pictures:
        for note in left_out(whole, picture):
            missing.setdefault(note, []).append(picture.short)
    return said + [f"On {text.listing(scenes, ALL)}: {note[0].lower()}{note[1:]}" for note, scenes in missing.items()]


def _place(view: View) -> str:
    return f"{'Over' if view.several else 'On'} {view.title},"


def _worst(front: Front) -> list[str]:
    """The scenes on which the modes that are not dominated have their largest errors; nothing for a single scene."""
    scenes: dict[str, list[str]] = {}
    for mark in front.marks:
        if mark.worst is not None and mark.worst.error > 0 and mark.name not in front.dominated:
            scenes.setdefault(mark.worst.scene, []).append(f"{mark.name} ({front.measure.said(mark.worst.error)})")
    return ["Worst scene: " + "; ".join(f"{scene} for {text.listing(m, ALL)}" for scene, m in scenes.items()) + "."] if scenes else []


def _everywhere(fronts: list[Front]) -> list[str]:
    """Modes that have nothing for them in any of several measures."""
    if len(fronts) < 2:
        return []
    return [m.name for m in fronts[0].marks if all(m.name in front.dominated for front in fronts)]


def finding(analysis: Analysis) -> str | None:
    """The two ends of the frontier by wrong pixels: of what a user can choose from, over scenes where there are several."""
    whole = trade.of(analysis)
    for view in [*reversed(whole.over_scenes), *whole.fastest.values()]:
        front = whole.front(view, measures.WRONG)
        if front is None or not front.frontier[0].speedup.has_interval:
            continue
        of_base = "the literal program" if whole.is_literal(view.bases[0]) else view.bases[0].config.numeric
        fast, exact = front.frontier[0], front.frontier[-1]
        count = sum(m.name != LITERAL for m in front.marks)
        if fast is exact:
            return (f"{_place(view)[:-1]} {fast.name} is the fastest of {text.count(count, 'numeric mode')} and none has fewer wrong pixels:"
                    f" {_ends(fast, of_base, front)}.")
        return (f"{_place(view)[:-1]} the frontier of {text.count(count, 'numeric mode')} runs from {_ends(fast, of_base, front)}, to"
                f" {_ends(exact, of_base, front)}.")
    return None


def _ends(mark: Mark, of_base: str, front: Front) -> str:
    speed = text.estimate(mark.speedup.value, mark.speedup.low, mark.speedup.high, "x") if mark.name != LITERAL else "1x"
    mean = " on average" if mark.worst is not None and mark.error else ""
    worst = f" (worst scene: {mark.worst.scene}, {measures.amount(mark.worst.error)})" if mark.worst and mark.worst.error else ""
    bound = ", without a bound" if mark.unbounded else ""
    wrong = f"{measures.amount(mark.error)} wrong pixel{'' if mark.error == 1 else 's'}" if mark.error else "no wrong pixel"
    return f"{mark.name}, {speed} the speed of {of_base} with {wrong}{mean}{worst}{bound}"
