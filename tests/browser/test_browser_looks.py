"""What can be read, reached and found: letters, keys alone, views, and windows of every size."""

from itertools import pairwise

import numpy as np
from browser_page import fits, tab, until

from ovita.studio import guide, turns
from ovita.writers.base import Reply

SAY = "Go left by 0.2 and slow down near the cup"
LEFT = ("Edit", "Look", "View", "Files", "Set up", "Say")
RIGHT = ("Plan", "Explanation", "Constraints", "Robot", "Code", "Changes", "Parameters")

UNREADABLE = """() => {  // every text with less contrast than 4.5 to what is behind it, or smaller than 12 pixels
  const parse = text => [...text.match(/[\\d.]+/g).map(Number), 1].slice(0, 4);
  const mix = (over, under) => [0, 1, 2].map(k => over[3] * over[k] + (1 - over[3]) * under[k]).concat(1);
  const light = colour => [0.2126, 0.7152, 0.0722].reduce((sum, share, k) => {
    const v = colour[k] / 255;
    return sum + share * (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
  }, 0);
  const paper = node => {
    const layers = [];
    for (let one = node; one; one = one.parentElement) {
      const colour = parse(getComputedStyle(one).backgroundColor);
      if (colour[3] > 0) layers.push(colour);
      if (colour[3] === 1) break;
    }
    return layers.reverse().reduce((under, over) => mix(over, under), [255, 255, 255, 1]);
  };
  const bad = [];
  let seen = 0;
  const judge = (node, style, text) => {
    const under = paper(node), [a, b] = [light(mix(parse(style.color), under)), light(under)].sort((p, q) => q - p);
    const ratio = (a + 0.05) / (b + 0.05), size = parseFloat(style.fontSize);
    seen++;
    if (ratio < 4.5 || size < 12) bad.push(`${text.trim().slice(0, 40)}: ${ratio.toFixed(2)}, ${size} px`);
  };
  for (const node of document.querySelectorAll("body *")) {
    if (!node.checkVisibility({ opacityProperty: true, visibilityProperty: true })) continue;
    if (node.closest(":disabled, [aria-disabled=true], [data-disabled], script, style, template")) continue;
    const style = getComputedStyle(node);
    const text = [...node.childNodes].filter(one => one.nodeType === 3).map(one => one.data).join("");
    if (text.trim()) judge(node, style, text);
    if (node.placeholder && !node.value) judge(node, getComputedStyle(node, "::placeholder"), node.placeholder);
    else if (node.matches("input[type=text], textarea, select") && node.value) judge(node, style, node.value);
  }
  return seen > 20 ? bad : ["hardly any text was found"];
}"""

SEEN = """() => {  // whether the control that has the focus looks otherwise than without
  const node = document.activeElement, parts = [node, node.parentElement];
  const look = () => {
    for (const one of document.getAnimations()) one.finish?.();
    return JSON.stringify(parts.map(one => getComputedStyle(one)).map(one => [one.outlineStyle, one.outlineWidth,
      one.outlineColor, one.boxShadow, one.borderColor, one.backgroundColor]));
  };
  const focused = look();
  node.blur();
  const plain = look();
  node.focus();
  return focused !== plain;
}"""
NAME = """() => {
  const node = document.activeElement, label = node.labels?.[0]?.textContent || node.title;
  return (node.ariaLabel || (node.tagName === "INPUT" ? label : "") || node.textContent || label).trim();
}"""
PLACE = "() => { const box = document.activeElement.getBoundingClientRect(); return [box.left, box.top]; }"


def session(page):
    return page.view.controller.session


def count(page):
    return len(session(page).steps)


def stacked(page):
    """Whether the scene, the sheet of panels and the dock stand one below the other, as on a phone."""
    parts = ("#root canvas", ".mantine-Paper-root:has(.bridge)", "#dock")
    boxes = [page.locator(part).first.bounding_box() for part in parts]
    if None in boxes or boxes[0]["height"] < 300:
        return False
    return all(abs(a["y"] + a["height"] - b["y"]) <= 2 for a, b in pairwise(boxes))


def test_every_text_can_be_read_and_every_window_has_its_panels(studio, browser):
    page = browser(studio, 1366, 768)
    box = page.locator("form input").first
    box.fill(SAY)
    box.press("Enter")
    until(lambda: count(page) == 1)
    page.mouse.move(700, 300)
    bad = {}

    def read(what):
        found = page.evaluate(UNREADABLE)
        bad.update({what: found} if found else {})

    for look in ("light", "dark"):
        for name in (*LEFT, *RIGHT):
            tab(page, name)
            read(f"{look} {name}")
        page.view.complain("This is what a complaint looks like.")
        page.wait_for_selector("text=This is what a complaint")
        page.keyboard.press("Escape")
        page.keyboard.press("?")
        page.wait_for_selector("#ovita-help[open]")
        read(f"{look} help and a notification")
        page.keyboard.press("Escape")
        page.locator("[data-do='dark']").click()
        page.wait_for_function(f"() => document.documentElement.dataset.mantineColorScheme !== '{look}'")
    assert bad == {}

    for name in ("View", "Plan", "Robot"):
        tab(page, name)
    page.wait_for_timeout(700)  # the page looks twice a second
    page.set_viewport_size({"width": 390, "height": 844})
    page.wait_for_selector(".mantine-Paper-root:has(.bridge)")
    page.wait_for_selector("[role=tab][aria-selected=true]:has-text('View')")
    assert page.evaluate(UNREADABLE) == []
    fits(page)
    until(lambda: stacked(page))  # on a busy machine the panels come to the bottom later than their tabs
    for name in ("Play", "sketch", "curvature"):
        button = page.locator("#dock").get_by_role("button", name=name)
        button.scroll_into_view_if_needed()
        at = button.bounding_box()
        assert at["x"] >= 0 and at["x"] + at["width"] <= 390 and at["y"] + at["height"] <= 844
    page.set_viewport_size({"width": 1366, "height": 768})
    for name in ("View", "Plan", "Robot"):
        page.wait_for_selector(f"[role=tab][aria-selected=true]:has-text('{name}')")
    until(lambda: page.locator("[role=tablist]").first.bounding_box()["width"] > 320)
    assert not page.broken


class Unsure:
    """Is certain of nothing."""

    name = "builtin"

    def write(self, prompt):
        code = "def adapt(traj, scene, *, left=0.2):\n    expect_moved(left=left)\n    return move(traj, left=left)\n"
        return Reply("policy", ("Shift the path 0.2 m to the left.",), code, unplaced=("feed",), confirm=True)


def test_the_whole_task_without_a_mouse(studio, browser):
    page = browser(studio, 1366, 768)
    press = page.keyboard.press
    places, unseen = [], []

    def focus(name, key="Tab"):
        """Go from control to control until one of that name has the focus."""
        for _ in range(90):
            press(key)
            found = page.evaluate(NAME)
            places.append((found, *page.evaluate(PLACE)))
            if found == name:
                unseen.extend([] if page.evaluate(SEEN) else [name])
                return
        raise AssertionError(f"{name!r} was not reached: {[p[0] for p in places[-90:]]}")

    page.view.controller.session.writer = Unsure()
    press("/")
    page.keyboard.type("left 20 cm, feed 0.7")
    assert page.evaluate(NAME) == "what should change" and page.evaluate(SEEN)
    press("Enter")
    page.wait_for_selector("text=Not used: 'feed'.")
    focus("Accept")
    press("Enter")
    until(lambda: count(page) == 1)
    assert session(page).steps[0].said == "left 20 cm, feed 0.7"  # whole, though Enter came at once
    page.wait_for_selector('label:text-is("left")')
    page.wait_for_timeout(700)
    focus("left")
    press("ArrowRight")
    until(lambda: count(page) == 2)
    focus("moment")
    for key in ("ArrowRight", "ArrowRight", "Shift+ArrowRight", "Shift+ArrowRight"):
        press(key)
    until(lambda: page.view.controller.selected == (2, 4))
    page.wait_for_selector("#dock [role=slider][aria-valuenow='5'][aria-valuetext*='waypoint 5 of 60, 3']")
    before = session(page).current
    press("Delete")
    until(lambda: len(session(page).current) == len(before) - 3)
    press("Control+z")
    until(lambda: session(page).current == before)
    focus("Files")
    press("Enter")
    focus("Result (JSON)")
    with page.expect_download() as download:
        press("Enter")
    assert download.value.suggested_filename.endswith(".json")
    assert unseen == [] and not page.broken
    # the reading order: the panel on the left from above, the one on the right, the timeline
    names = [name for name, *_ in places]
    assert names.index("Accept") < names.index("left") < names.index("moment") < names.index("Files")
    nameless = [place for place in places if not place[0]]
    assert nameless == []


def framed(page, view):
    """Whether the camera is where a view of everything puts it, for the size that the page has now."""
    space = page.view.space
    wanted = space._seen.camera(session(page).scene.frame, space._aspect(), 0.75, view)[0]
    return np.linalg.norm(np.asarray(page.view.client.camera.position) - wanted) < 0.02 * space._seen.size


def test_the_list_of_keys_is_what_the_page_hears(studio, browser):
    page = browser(studio)
    listed = {key.wish for keys in guide.KEYS.values() for key in keys if key.keys}
    done = page.evaluate("() => [...Object.keys(ovitaActs), ...Object.keys(ovitaTimeline.acts)]")
    assert listed == set(done)

    camera = page.view.client.camera
    for key, view in (("1", "top"), ("2", "front"), ("3", "side"), ("h", "fit")):
        page.keyboard.press("Escape")
        page.keyboard.press(key)
        until(lambda view=view: framed(page, view))
    assert [label.text for label in page.view.space._labels if label.text.startswith("grid")] == ["grid 0.1 m"]

    page.keyboard.press("4")
    page.wait_for_selector("text=goes along with what moves")
    away = np.asarray(camera.position) - np.asarray(camera.look_at)
    page.keyboard.press("Space")
    until(lambda: not page.view.player._playing.is_set() and page.view.player.moment > 5.0)
    goal = session(page).current.positions[-1]
    until(lambda: np.linalg.norm(np.asarray(camera.look_at) - goal) < 0.03 * page.view.space.stage.size)
    assert np.linalg.norm(np.asarray(camera.position) - np.asarray(camera.look_at) - away) < 0.03
    page.keyboard.press("h")
    until(lambda: not page.view.space.following)
    assert set(turns.VIEWS) == {"fit", "top", "front", "side", "follow"} and not page.broken
