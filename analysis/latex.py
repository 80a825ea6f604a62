"""LaTeX tables with booktabs, without any package that a thesis template may lack."""

from __future__ import annotations

import pandas as pd

SPECIAL = {"\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}",
           "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
           "|": r"\textbar{}", "–": "--", "≈": r"$\approx$", "×": r"$\times$", "\n": " "}
LONG = 40  # more rows do not fit on a page


def escape(value: object) -> str:
    """One character at a time, so that the braces of one replacement are not escaped by the next."""
    return "".join(SPECIAL.get(c, c) for c in str(value))


def table(frame: pd.DataFrame, caption: str, label: str) -> str:
    numeric = [all(str(v).strip()[:1].isdigit() or not str(v).strip() for v in frame[c]) for c in frame]
    columns = "".join("r" if n else "l" for n in numeric)
    head = " & ".join(escape(c) for c in frame) + r" \\"
    # Braces keep a leading bracket from being read as the optional argument of the row end before it.
    rows = [" & ".join("{" + escape(v) + "}" if str(v).startswith("[") else escape(v) for v in row) + r" \\"
            for row in frame.astype(object).itertuples(index=False, name=None)]
    note = r"% \usepackage{booktabs}" + (r" \usepackage{longtable}" if len(frame) > LONG else "")
    captioned = rf"\caption{{{escape(caption)}}}\label{{{label}}}"
    if len(frame) > LONG:
        lines = [note, rf"\begin{{longtable}}{{{columns}}}", captioned + r" \\", r"\toprule", head, r"\midrule", r"\endfirsthead",
                 r"\toprule", head, r"\midrule", r"\endhead", r"\bottomrule", r"\endfoot", *rows, r"\end{longtable}"]
    else:
        lines = [note, r"\begin{table}", r"\centering", captioned, rf"\begin{{tabular}}{{{columns}}}", r"\toprule", head,
                 r"\midrule", *rows, r"\bottomrule", r"\end{tabular}", r"\end{table}"]
    return "\n".join(lines) + "\n"
