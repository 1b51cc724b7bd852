"""A whole study with 12 simulated participants, each in a browser; their answers are test data."""

import os
import signal
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "study"))
from made_study import write_design, write_run
from test_durability import process
from visitor import Visitor

from ovita.study.answers import progress_of, ratings
from ovita.study.folder import address_of, found_study
from ovita.study.offline import collect, write_files

SIZE = {"width": 620, "height": 480}


@pytest.fixture
def make(tmp_path):
    def made(writers=("builtin", "baseline:copy"), **changes):
        run = write_run(tmp_path / "run", samples=4, writers=writers)
        wanted = {"participants": 12, "per_person": 2, "attention": 1, "questionnaires": ["tlx", "umux"]} | changes
        return found_study(write_design(tmp_path / "design", **wanted), [run], str(tmp_path / "study"))

    return made


@pytest.fixture
def tabs(chromium):
    """Opens tabs of one browser; what goes wrong or leaves the machine is kept in `broken`."""
    contexts, broken = [], []

    def open_tab(base, context=None):
        context = context or chromium.new_context(viewport=SIZE, accept_downloads=True)
        contexts.append(context)
        tab = context.new_page()
        tab.set_default_timeout(90_000)
        tab.on("pageerror", lambda error: broken.append(str(error)))
        tab.on("request", lambda r: None if r.url.startswith((base, "data:", "blob:")) else broken.append(r.url))
        return tab

    yield open_tab
    for context in dict.fromkeys(contexts):
        context.close()
    assert broken == []


STAND_IN = """
window.Plotly = {
  newPlot: (plot, data) => {
    plot.on = () => {};
    plot.textContent = `${data.length} traces`;
    return Promise.resolve();
  },
  restyle: (plot, change) => { plot.dataset.moved = JSON.stringify(change.x); return Promise.resolve(); },
  relayout: () => Promise.resolve(),
};
"""
"""Stands in for the drawing library, which is slow without a graphics card; `test_one_file` has the real one."""


def sketched(tab):
    """Draw the pages of a tab with the stand-in."""
    tab.route("**/assets/plotly.js", lambda route: route.fulfill(body=STAND_IN, content_type="text/javascript"))
    return tab


def drawn(tab):
    tab.wait_for_function("() => [...document.querySelectorAll('main .view')].every(view => view.dataset.ready)")
    assert tab.evaluate("() => document.documentElement.scrollWidth <= window.innerWidth")


def heading(tab):
    return tab.locator("main h1").inner_text()


FILL = """() => {
  for (const box of document.querySelectorAll('main fieldset')) {
    const radios = box.querySelectorAll('[type=radio]');
    if (radios.length) radios[1].click();
    else {
      const range = box.querySelector('[type=range]');
      range.stepUp();
      range.dispatchEvent(new Event('input', {bubbles: true}));
    }
  }
  document.querySelector('[name=agree]')?.click();
}"""
"""Answers a page as `fill` does, in one go."""


def fill(tab, quick=False):
    if quick:
        tab.evaluate(FILL)
        return
    if tab.locator("[name=agree]").count():
        tab.check("[name=agree]")
    for box in tab.locator("main fieldset").all():
        if box.locator("[type=radio]").count():
            box.locator("[type=radio]").nth(1).check()
        else:
            box.locator("[type=range]").press("ArrowRight")


def step(tab, said="go up by 0.1", quick=False):
    if tab.locator("[name=said]").count() and not tab.locator("text=Finished with this path?").count():
        tab.fill("[name=said]", said)
        tab.click("button[value=say]")
        tab.wait_for_selector("text=Finished with this path?")
        return
    tab.wait_for_load_state()  # the sliders listen once the page's scripts are there
    before = heading(tab), tab.locator(".where").all_inner_texts()
    fill(tab, quick)
    tab.click("main button.main")
    tab.wait_for_function(
        "([h, w]) => document.querySelector('main h1')?.innerText !== h"
        " || (document.querySelector('.where')?.innerText ?? '') !== (w[0] ?? '')",
        arg=list(before),
    )


def until(tab, words):
    for _ in range(40):
        if heading(tab).startswith(words):
            return
        step(tab)
    raise AssertionError(heading(tab))


@pytest.mark.limit_s(400)
def test_twelve_people(make, tabs):
    study = make(adapt={"items": 1})
    links = [address_of(token) for token in study.tokens.values()]
    with process(study, drawn=True) as (server, base):
        port = int(base.rpartition(":")[2])
        one = sketched(tabs(base))
        one.goto(base + links[0])
        until(one, "Change this path")
        step(one)
        drawn(one)
        one.reload()
        assert one.locator(".talk li").count() == 1, "a reload says nothing twice"
        until(one, "Result")
        two = sketched(tabs(base, one.context))
        two.goto(base + links[0])
        assert two.locator(".where").inner_text() == one.locator(".where").inner_text()
        where = two.locator(".where").inner_text()
        step(two)
        step(one)
        assert two.locator(".where").inner_text() == one.locator(".where").inner_text() != where, "a page counts once"
        two.close()
        one.go_back()
        step(one)
        one.wait_for_load_state()
        os.kill(server.pid, signal.SIGKILL)
    with process(study, port, drawn=True) as (_, base):
        crowd = [sketched(tabs(base)) for _ in links[2:]]
        for tab, link in zip(crowd, links[2:], strict=True):
            tab.goto(base + link)
        while going := [tab for tab in crowd if not heading(tab).startswith("Thank you")]:
            for tab in going:
                step(tab, quick=True)
        until(one, "Which one")
        drawn(one)
        assert one.locator("main .view").count() == 2
        start = one.locator(".plot").first.get_attribute("data-moved")
        one.locator(".player button").first.click()
        one.wait_for_function("() => !document.querySelector('.player output').textContent.startsWith('0.0')")
        assert one.locator(".plot").first.get_attribute("data-moved") != start
        until(one, "Thank you")
        late = sketched(tabs(base))
        late.goto(base + links[1])
        until(late, "How demanding")
        late.click("summary")
        late.click("button.danger")
        late.wait_for_selector("text=You have withdrawn")
        last = Visitor(base, links[2])
        assert "You have withdrawn" in last.post(do="withdraw"), "also after the end, by the same link"
    found = ratings(study.path)
    assert len({r.participant for r in found}) == 10 and all(r.pilot for r in found)
    for person in study.participants.values():
        progress = progress_of(study, person)
        answered = [event.page for event in progress.events if event.event == "answer"]
        assert answered == ([] if progress.withdrawn else [page.id for page in person.pages])
    first = [turn.said for turn in progress_of(study, study.participants["p01"]).turns("s002")]
    assert first == ["go up by 0.1"]


def test_one_file(make, tabs, tmp_path):
    study = make(("builtin",), participants=1, per_person=1, questionnaires=["tlx"])
    file = write_files(study, str(tmp_path / "files"))[0]
    tab = tabs("file://")
    tab.goto(file.as_uri())
    tab.click("main button.main")
    tab.wait_for_selector("text=Please tick the box")
    until(tab, "Result")
    drawn(tab)
    where = tab.locator(".where").inner_text()
    tab.click("main button.main")
    tab.wait_for_selector("text=Please answer")
    tab.reload()
    assert tab.locator(".where").inner_text() == where, "a reload loses nothing"
    until(tab, "Thank you")
    with tab.expect_download() as download:
        tab.click("main button.main")
    download.value.save_as(tmp_path / "answers.jsonl")
    assert collect(study, str(tmp_path / "answers.jsonl")).new == len(study.participants["p1"].pages)
    assert {r.value for r in ratings(study.path) if r.question == "correctness"} == {2.0}
    tab.click("summary")
    tab.click("button.danger")
    tab.wait_for_selector("text=Everything that this browser kept was deleted")
