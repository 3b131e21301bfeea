"""Plot the measurements."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter

from .figures import Section

_COLORS: Final = {"bare": "#9aa0a6", "ours": "#0b7285", "ice": "#e8590c"}
_SHOWN: Final = 0.995  # share of the values: the last few would take half of a panel
_NAMES: Final = {"bare": "bare Zenoh", "ours": "zenoh_ice", "ice": "Ice"}


def draw(sections: Mapping[str, Section], path: Path) -> None:
    """Plot a panel for each section with results."""
    panels = [(name, panel) for name, panel in _PANELS if name in sections]
    columns = min(len(panels), 2)
    rows = -(-len(panels) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(5.2 * columns, 3.3 * rows), squeeze=False)
    for axis in axes.flat[len(panels) :]:
        axis.set_visible(False)
    for axis, (name, panel) in zip(axes.flat, panels, strict=False):
        panel(axis, sections[name].plot)
        axis.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _calls(axis: Any, plot: dict[str, Any]) -> None:  # noqa: ANN401
    for kind in ("bare", "ours", "ice"):
        _cumulative(axis, [1e6 * time for time in plot[kind]], kind)
    axis.set(title="small call", xlabel="us", ylabel="share of calls")
    axis.legend(frameon=False)


def _images(axis: Any, plot: dict[str, Any]) -> None:  # noqa: ANN401
    _bars(axis, {size: {kind: 1e3 * each for kind, each in kinds.items()} for size, kinds in plot.items()})
    axis.set(title="image call", ylabel="ms, median")


def _streams(axis: Any, plot: dict[str, Any]) -> None:  # noqa: ANN401
    for kind in ("ours", "ice"):
        rate = plot["rates"][kind]
        label = f"{_NAMES[kind]}: {rate:.0f} frames/s at most"
        _cumulative(axis, [1e3 * time for time in plot["latencies"][kind]], kind, label)
    axis.set(title="1280x960 stream, 30 frames/s", xlabel="latency in ms", ylabel="share of frames")
    axis.set_ylim(top=1.4)  # room for the long names
    axis.legend(frameon=False)


def _clients(axis: Any, plot: dict[str, Any]) -> None:  # noqa: ANN401
    for kind in ("ours", "ice"):
        rates = sorted(plot[kind])
        axis.plot(range(1, len(rates) + 1), rates, "o", color=_COLORS[kind], label=_NAMES[kind])
    axis.set(title="16 clients, one server", xlabel="client, the slowest first", ylabel="calls a second")
    axis.set_ylim(bottom=0)
    axis.legend(frameon=False)


def _joints(axis: Any, plot: dict[str, Any]) -> None:  # noqa: ANN401
    for kind in ("ours", "ice"):
        _cumulative(axis, [1e6 * time for time in plot[kind]], kind)
    axis.set(title="26 doubles at 1 kHz to 8 subscribers", xlabel="latency in us", ylabel="share")
    axis.legend(frameon=False)


def _beside(axis: Any, plot: dict[str, Any]) -> None:  # noqa: ANN401
    _bars(
        axis,
        {
            f"{value}\n{how}": {kind: 1e6 * plot[f"{kind}, {how}"][value] for kind in ("ours", "ice")}
            for how in ("alone", "beside", "beside a simulator")
            for value in ("p50", "p99")
        },
    )
    axis.set(title="a call alone, beside a 1280x960 stream, beside a simulator", ylabel="us")


def _soak(axis: Any, plot: dict[str, Any]) -> None:  # noqa: ANN401
    _memory(axis, plot, "memory")
    axis.set(title="soak: private memory", xlabel="minutes", ylabel="MB")


def _soak_shared(axis: Any, plot: dict[str, Any]) -> None:  # noqa: ANN401
    _memory(axis, plot, "shared")
    axis.set(title="soak: shared memory", xlabel="minutes", ylabel="MB")


def _memory(axis: Any, plot: dict[str, Any], kind: str) -> None:  # noqa: ANN401
    for name, color in (("server", _COLORS["ours"]), ("client", _COLORS["ice"])):
        axis.plot(plot[name]["minutes"], plot[name][kind], color=color, label=name, linewidth=1)
    axis.set_ylim(bottom=0)
    axis.legend(frameon=False)


def _cumulative(axis: Any, values: list[float], kind: str, label: str = "") -> None:  # noqa: ANN401
    axis.set_xscale("log")
    axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.xaxis.set_major_formatter(lambda value, _: _short(value))
    axis.xaxis.set_minor_formatter(NullFormatter())
    shares = np.linspace(0.0, _SHOWN, min(len(values), 1000))
    axis.plot(np.quantile(values, shares), shares, color=_COLORS[kind], label=label or _NAMES[kind])


def _short(value: float) -> str:
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def _bars(axis: Any, groups: dict[str, dict[str, float]]) -> None:  # noqa: ANN401
    for offset, kind in ((-0.2, "ours"), (0.2, "ice")):
        places = np.arange(len(groups)) + offset
        bars = axis.bar(
            places, [group[kind] for group in groups.values()], 0.38, color=_COLORS[kind], label=_NAMES[kind]
        )
        axis.bar_label(bars, fmt=_short, fontsize=8)
    axis.set_xticks(range(len(groups)), list(groups))
    axis.margins(y=0.25)
    axis.legend(frameon=False, ncols=2, loc="upper left")


_PANELS: Final[tuple[tuple[str, Callable[[Any, dict[str, Any]], None]], ...]] = (
    ("calls", _calls),
    ("images", _images),
    ("streams", _streams),
    ("clients", _clients),
    ("joints", _joints),
    ("beside", _beside),
    ("soak", _soak),
    ("soak", _soak_shared),
)
