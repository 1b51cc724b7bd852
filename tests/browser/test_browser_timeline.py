"""The timeline and the line in the scene, by mouse and keyboard."""

import pytest
from browser_page import at_rest, until

SAY = "Go left by 0.2 and slow down near the cup"


def session(page):
    return page.view.controller.session


def say(page, text):
    count = len(session(page).steps)
    box = page.locator("form input").first
    box.fill(text)
    box.press("Enter")
    until(lambda: len(session(page).steps) == count + 1, 60)
    page.wait_for_function(f"() => ovitaTimeline.state().paths[1]?.count === {len(session(page).current)}")


def place(page, waypoint):
    """Where a waypoint of the adapted line is on the screen."""
    return page.evaluate(
        "i => { const path = ovitaTimeline.state().paths[1], box = ovitaTimeline.scene().getBoundingClientRect();"
        " return ovitaTimeline.seen([path.x[i], path.y[i], path.z[i]], box); }",
        waypoint,
    )[:2]


def state(page, what):
    return page.evaluate(f"() => ovitaTimeline.state().{what}")


def stroke(page, first, *rest):
    """Press at a waypoint and drag along others: each where it is by then, since a busy page moves its camera late."""
    page.mouse.move(*place(page, first))
    page.mouse.down()
    for waypoint in rest:
        page.mouse.move(*place(page, waypoint))
    page.mouse.up()


def drag(page, start, *points):
    page.mouse.move(*start)
    page.mouse.down()
    for point in points:
        page.mouse.move(*point)
    page.mouse.up()


def test_one_cursor_and_a_part_that_words_mean(studio, browser):
    page = browser(studio, 1366, 768)
    say(page, SAY)
    page.wait_for_function("() => ovitaTimeline.state().acts.length > 0")
    chart = page.locator("#dock canvas").bounding_box()
    assert chart["width"] == 1366
    page.mouse.move(700, chart["y"] + 80)
    tip = page.locator("#dock-tip")
    tip.wait_for()
    moment = state(page, "glance")
    assert f"{moment:.2f} s" in tip.inner_text() and "to cup" in tip.inner_text()
    balls = page.view.heads._nodes
    until(
        lambda: len(balls) == 2 and abs(balls[1].position - session(page).current.at(moment).positions[0]).max() < 1e-3
    )

    at_rest(page)
    x, y = place(page, 30)
    page.mouse.move(x + 1, y + 1)
    page.wait_for_function("() => document.querySelector('#dock-tip').innerText.includes('adapted')")
    until(lambda: abs(state(page, "glance") - session(page).current.times[30]) < 0.15)
    page.mouse.move(700, 20)
    until(lambda: state(page, "glance") is None)

    drag(page, (400, chart["y"] + 80), (500, chart["y"] + 80), (700, chart["y"] + 80))
    until(lambda: page.view.controller.selected is not None)
    first, last = page.view.controller.selected
    before = session(page).current.positions
    say(page, "this part 5 cm up")
    up = session(page).current.positions[:, 2] - before[:, 2]
    assert up[(first + last) // 2] == pytest.approx(0.05) and not up[:first].any() and not up[last + 1 :].any()

    page.mouse.wheel(0, -400)
    until(lambda: state(page, "view") is not None)
    page.locator("#dock canvas").focus()
    page.keyboard.press("ArrowRight")
    until(lambda: page.view.player.moment > 0.0)
    camera = page.view.client.camera.position
    page.keyboard.press("ArrowRight")
    page.wait_for_timeout(300)
    assert (page.view.client.camera.position == camera).all()
    assert not page.broken


def test_waypoints_are_picked_and_deleted_and_a_stroke_is_followed(studio, browser):
    page = browser(studio, 1366, 768)
    say(page, SAY)
    at_rest(page)
    page.mouse.click(*place(page, 20))
    until(lambda: str(page.view.hand.what.value).startswith("waypoint"))
    picked = int(page.view.hand.what.value.split()[1])
    assert abs(picked - 21) <= 2
    page.keyboard.press("Delete")
    until(lambda: len(session(page).current) == 59)
    assert session(page).steps[-1].said == f"deleted waypoint {picked}"
    page.wait_for_function("() => ovitaTimeline.state().paths[1]?.count === 59")
    at_rest(page)

    page.keyboard.down("Shift")
    stroke(page, 15, 20, 30)
    page.keyboard.up("Shift")
    until(lambda: page.view.controller.selected is not None)
    assert abs(page.view.controller.selected[0] - 15) <= 3 and abs(page.view.controller.selected[1] - 30) <= 3
    page.keyboard.press("Escape")
    until(lambda: page.view.controller.selected is None)

    before = session(page).current.positions
    page.get_by_role("button", name="sketch").click()
    (ax, ay), (bx, by) = place(page, 15), place(page, 40)
    drag(page, (ax, ay), ((2 * ax + bx) / 3, ay - 60), ((ax + 2 * bx) / 3, by - 60), (bx, by))
    until(lambda: len(session(page).steps) == 3)
    assert session(page).steps[-1].said.startswith("sketched a new way from waypoint")
    rise = session(page).current.positions[:, 2] - before[:, 2]
    assert rise[20:35].max() > 0.03 and abs(rise[:10]).max() < 1e-9 and abs(rise[46:]).max() < 1e-9
    page.wait_for_selector("text=stiffness")
    page.keyboard.press("Control+KeyZ")
    until(lambda: len(session(page).steps) == 2)

    page.locator("select[aria-label=compare]").select_option("side by side")
    page.wait_for_function("() => { const c = document.querySelector('#dock-over'); return c.width > 100; }")
    page.get_by_role("button", name="Play").click()
    until(lambda: page.view.player.moment > 0.2)
    assert abs(state(page, "now") - page.view.player.moment) < 0.5
    assert not page.broken
