"""The figures of random series of trials: the same on the page and in the terminal, and none that is no number."""

from __future__ import annotations

import io
import random
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final, TypedDict

import msgspec
import pytest
from playwright.sync_api import Browser, Page
from rich.console import Console

from tests.support.browser import new_context
from tests.support.soak import repeated
from visualhfsm._base.languages import in_all_languages
from visualhfsm.trials import Outcome, Plan
from visualhfsm_trials._comparison import Comparison
from visualhfsm_trials._drawn import view_of
from visualhfsm_trials._page import trials_page
from visualhfsm_trials._record import Header, Record
from visualhfsm_trials._statistics import figure
from visualhfsm_trials._summary import summarize
from visualhfsm_trials._terminal import show, show_comparison

pytestmark = pytest.mark.slow

SERIES: Final = repeated(test=4, soak=500)
COUNTS: Final = (1, 2, 3, 4, 5, 6, 9, 19, 20, 21, 40)
NO_NUMBER: Final = re.compile(r"\b(nan|inf|infinity|undefined|null)\b|∞", re.IGNORECASE)

Draw = Callable[[random.Random], float]
NUMBERS: Final[dict[str, Draw]] = {
    "even": lambda dice: dice.uniform(-1.0, 1.0),
    "skewed": lambda dice: dice.expovariate(1.0),
    "whole": lambda dice: float(dice.randint(0, 3)),
    "two": lambda dice: dice.choice((0.0, 1.0)),
    "zero": lambda _: 0.0,
    "same": lambda _: 0.3,
    "rounded": lambda dice: dice.choice((0.3, 0.1 + 0.2)),
    "rare": lambda dice: dice.choice((0.3, 0.1 + 0.2, 0.3, 0.3, 5.0)),
    "huge": lambda dice: dice.uniform(-1.0, 1.0) * 1e300,
    "tiny": lambda dice: dice.uniform(-1.0, 1.0) * 1e-300,
    "mixed": lambda dice: dice.choice((-1.0, 1.0)) * 10.0 ** dice.uniform(-20.0, 20.0),
    "offset": lambda dice: 1e9 + dice.random(),
}
"""The kinds of numbers that a plan may note: of each series some, each missing in some trials."""

READ: Final = """async (view) => {
  const {unpacked} = await import("onefile/unpacked.js");
  const shown = document.querySelector("hfsm-trials");
  shown.view = unpacked(view);
  await shown.updateComplete;
  const text = (each) => each?.textContent.replace(/\\s+/g, " ").trim() ?? "";
  const figures = (name) => [...shown.querySelectorAll(`[aria-label="${name}"] figure`)];
  return {
    all: shown.textContent + [...shown.querySelectorAll("*")].flatMap((each) =>
      [...each.attributes].map(({value}) => ` ${value}`)).join(""),
    rate: text(shown.querySelector(".rate-figure")),
    interval: text(shown.querySelector(".trials-rate .muted")),
    numbers: Object.fromEntries(figures("Numbers").map((each) => [
      text(each.querySelector("b")),
      [text(each.querySelector("figcaption .muted")), ...[...each.querySelectorAll(".between span")].map(text)],
    ])),
    parts: Object.fromEntries(figures("What success depends on").map((each) => [
      text(each.querySelector("b")),
      {
        means: [...each.querySelectorAll("thead th")].map(text),
        rows: [...each.querySelectorAll("tbody tr")].map((row) => [...row.children].map(text)),
      },
    ])),
  };
}"""


class Parts(TypedDict):
    means: list[str]
    rows: list[list[str]]


class Shown(TypedDict):
    all: str
    rate: str
    interval: str
    numbers: dict[str, list[str]]
    parts: dict[str, Parts]


def drawn(dice: random.Random, count: int, chosen: dict[str, float], rate: float) -> list[Outcome]:
    """Return the outcomes of a series whose numbers are missing as often as `chosen` says."""
    time = NUMBERS[dice.choice(["even", "same", "rounded", "skewed"])]
    level = dice.choice(("even", "same", "rounded", "whole", "mixed"))
    outcomes = []
    for number in range(1, count + 1):
        success = dice.random() < rate
        outcomes.append(
            Outcome(
                number=number,
                values={
                    "level": NUMBERS[level](dice),
                    "light": dice.choice(("dark", "bright", "1e3")),
                    "noise": dice.random() < 0.5,
                },
                success=success,
                reason="" if success else dice.choice(("fell", "not in goal after 9 s")),
                time=abs(time(dice)),
                states="goal",
                numbers={name: NUMBERS[name](dice) for name in chosen if dice.random() >= chosen[name]},
            )
        )
    return outcomes


def printed(print_it: Callable[[Console], None]) -> str:
    console = Console(file=io.StringIO(), width=400)
    print_it(console)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def rows_of(text: str, title: str) -> list[list[str]]:
    """Return the cells of a table in the terminal, without its head."""
    if title not in text:
        return []
    table = text[text.index(title) :].partition("\n\n")[0]
    return [re.split(r" {2,}", line.strip()) for line in table.splitlines()[2:]]


def check_numbers(page: Shown, said: str) -> None:
    """The median and the quartiles of a number are those of the terminal."""
    there = {name: cells for name, *cells in rows_of(said, "Numbers of ")}
    assert {*page["numbers"]} <= {*there}
    for name, (words, *_) in page["numbers"].items():
        _, lower, median, upper, *_ = there[name]
        assert words == f"median {median}, half of them {lower} to {upper}"


def check_parts(page: Shown, said: str, names: Sequence[str]) -> None:
    """How many succeed of each part, and the means of numbers, are those of the terminal."""
    there = []
    for row in rows_of(said, "What it depends on"):
        for place, cell in enumerate(row):
            if re.fullmatch("[█░]+", cell):
                there.append([row[place - 1], *row[place + 1 :]])
    here = []
    for parts in page["parts"].values():
        for label, _, succeed, *means in parts["rows"]:
            of = dict(zip(parts["means"], means, strict=True))
            here.append([label, succeed, *(of[name] for name in names if of.get(name))])
    assert there in (
        [],
        here,
    )  # the terminal leaves them out if all succeed or all fail, and nothing is noted


@pytest.fixture
def page(browser: Browser, tmp_path: Path) -> Iterator[Page]:
    file = tmp_path / "first.outcomes.jsonl"
    with Record(file, Header("walk.xml", "", {})) as record:
        record.add(Outcome(number=1, values={}, success=True))
    path = tmp_path / "page.html"
    path.write_text(trials_page(view_of(Plan(document="walk.xml"), summarize(file, (), 1), file)), "utf-8")
    with new_context(browser) as context:
        shown = context.new_page()
        shown.goto(path.as_uri())
        shown.locator(".rate-figure").wait_for()
        yield shown


def test_figures_of_random_series_are_the_same_on_page_and_terminal(page: Page, tmp_path: Path) -> None:
    varying = ("level", "light", "noise")
    for seed in range(SERIES):
        dice = random.Random(seed)
        count, rate = dice.choice(COUNTS), dice.choice((0.0, 0.3, 0.8, 1.0))
        chosen = {name: dice.choice((0.0, 0.0, 0.4, 0.95)) for name in dice.sample([*NUMBERS], 4)}
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            files = [tmp_path / f"{seed}.{which}" for which in ("first", "second")]
            for file in files:
                with Record(file, Header("walk.xml", "", {})) as record:
                    record.look(dice.choice((count, 2 * count)))
                    for each in drawn(dice, count, chosen, rate):
                        record.add(each)
                    record.look(count)
            summary, other = (summarize(file, varying, count) for file in files)
            said = printed(lambda console, summary=summary: show(console, summary, "walk"))  # type: ignore[misc]
            compared = printed(
                lambda console, both=(summary, other): show_comparison(console, Comparison(*both), ("a", "b"))  # type: ignore[misc]
            )
            view = view_of(Plan(document="walk.xml", runs=count, robot="none"), summary, files[0])
        check_comparison(compared)
        found: Shown = page.evaluate(READ, msgspec.json.encode(view, enc_hook=in_all_languages).decode())
        for text in (said, compared, found["all"]):
            assert not NO_NUMBER.search(text), (seed, NO_NUMBER.search(text), text)
        rate_said = re.search(r"succeed: (\S+ %)  \((\S+) to (\S+ %)\)", said)
        assert rate_said, said
        assert found["rate"] == rate_said[1], seed
        between = f"The true rate is between {rate_said[2]} % and {rate_said[3]}, with a confidence of 95 %."
        assert found["interval"] == between, seed
        for words in ("Fewer than 20 trials say little.", "Trials were added after a look"):
            assert (words in found["all"]) == (words in said), (seed, words)
        check_numbers(found, said)
        check_parts(found, said, summary.own_numbers)
        assert [shown[1] for shown in found["numbers"].values()] == [
            figure(histogram.edges[0]) for histogram in view.histograms
        ]


def check_comparison(text: str) -> None:
    """An interval is around its difference."""
    for mean, low, high in re.findall(r"([+-]?[\d.e-]+)(?: %)?  \(([+-]?[\d.e-]+) to ([+-]?[\d.e-]+)", text):
        assert float(low) <= float(mean) <= float(high), text
