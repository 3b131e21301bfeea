"""Write how wide the letters of pictures are, by `python -m tools.fonts.letter_widths`.

Python and the page break texts into the same lines on every machine: neither measures with a font that the
machine has or lacks. The widths are those of DejaVu Sans, which comes with matplotlib; of the fonts that a
picture names it is the widest, so that a text fits in each of them.
"""

from __future__ import annotations

import unicodedata
from itertools import chain
from pathlib import Path
from typing import Final

__all__ = ["FILE", "letter_widths", "written"]

_ROOT: Final = Path(__file__).parents[2]
_RANGES: Final = ((0x20, 0x17F), (0x370, 0x45F), (0x2010, 0x2027), (0x2030, 0x203A), (0x20AC, 0x20AC))
"""Letters of Europe, punctuation and the euro."""
_SIGNS: Final = "←↑→↓↔⇒∀∂∃∅∆∈∏∑−√∞∠∧∨∩∪≈≠≤≥"
_NO_BREAK: Final = "\N{NO-BREAK SPACE}"
_HEAD: Final = "Written by `python -m tools.fonts.letter_widths` from DejaVu Sans 2.35. Do not edit."
_ABOUT: Final = "Letters without accents by their width, in thousandths of their size."
_WIDEST: Final = 95  # letters of a row of the table, about
FILE: Final = _ROOT / "visualhfsm/_editor/static/measures/letter-widths.js"
"""What is written; `visualhfsm._drawing.text` reads it, too."""


def letter_widths() -> dict[int, str]:
    """Return letters of the font by their width, in thousandths of their size."""
    import matplotlib as mpl  # 15 MB that few tests need
    from matplotlib.ft2font import FT2Font, LoadFlags

    font = FT2Font(str(Path(mpl.get_data_path(), "fonts", "ttf", "DejaVuSans.ttf")))
    known = font.get_charmap()
    found: dict[int, str] = {}
    for code in chain(*(range(first, last + 1) for first, last in _RANGES), map(ord, _SIGNS)):
        letter = chr(code)
        is_letter = letter.isprintable() or letter == _NO_BREAK
        if is_letter and code in known and unicodedata.normalize("NFD", letter) == letter:
            glyph = font.load_char(code, LoadFlags.NO_SCALE)
            wide = round(1000 * glyph.horiAdvance / font.units_per_EM)
            found[wide] = found.get(wide, "") + letter
    return dict(sorted(found.items()))


def written() -> str:
    """Return the content of the file."""
    rows = [""]
    for wide, letters in letter_widths().items():
        text = letters.replace("\\", "\\\\").replace('"', '\\"').replace(_NO_BREAK, r"\u00a0")
        if len(rows[-1] + text) > _WIDEST:
            rows.append("")
        rows[-1] += f' {wide}: "{text}",'
    lines = [
        f"/** {_HEAD} */",
        "",
        f"/** {_ABOUT} @type {{Record<number, string>}} */",
        "// prettier-ignore",
        "export const LETTER_WIDTHS = {",
        *(f" {row}" for row in rows),
        "};",
        "",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    FILE.write_text(written(), "utf-8")
