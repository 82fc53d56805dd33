"""``mplearn live`` as a user runs it: its processes, and a real browser."""

import signal

import psutil
import pytest

pytest.importorskip("uvicorn", reason="needs the extra 'ui'")
from benchmarks.teaching_session import NAMES, PATIENCE_S, drawn_seldom, live, session, until

DRAWN_SELDOM = True  # how pages are drawn is tested where no learner and no robot run beside


@pytest.fixture(scope="module")
def address():
    """A page on which the demonstrator is learned from, faster than a person moves."""
    with live("demonstrator:3", "--speed", "8") as (url, _):
        yield url


def rows(page):
    return page.locator("#tree .row")


def known(page, n=4):
    until(lambda: rows(page).count() >= n, PATIENCE_S, f"{n} primitives")
    return page


def note(page, text):
    """Wait for a note, and let go of it."""
    until(lambda: text in page.locator("#notes").inner_text(), 20, text)


def test_what_is_known_grows_and_everything_moves(address, new_page):
    page = known(new_page(address))
    before = rows(page).count()
    until(lambda: page.locator("#state").get_attribute("data-live") == "yes", PATIENCE_S)
    until(lambda: rows(page).count() > before, PATIENCE_S, "more primitives")
    until(lambda: page.locator("#graph .edge").count() > 2, PATIENCE_S)
    until(lambda: page.locator(".present[data-lit=yes]").count() == 1, PATIENCE_S)
    until(lambda: page.locator("#log li").count() > 2, PATIENCE_S)
    figures = page.locator("#figures").inner_text()
    assert "person 1" in figures and "Hz" in figures and "ms" in figures
    until(lambda: float(page.get_attribute("html", "data-fps") or 0) > 0, PATIENCE_S)


def test_a_click_shows_figure_and_robot(address, new_page):
    page = known(new_page(address))
    rows(page).nth(1).click()
    until(lambda: page.get_attribute("html", "data-shown"), PATIENCE_S, "the figure")
    until(lambda: page.get_attribute("html", "data-robot"), PATIENCE_S, "the robot")


def test_two_teachers_see_the_same_and_undo_each_other(address, new_page):
    anna, bob = known(new_page(address)), known(new_page(address))
    id = rows(anna).first.get_attribute("data-id")
    name = f'[data-id="{id}"] text.name'
    rows(anna).first.click()
    anna.keyboard.press("n")
    anna.keyboard.insert_text("<i>raise</i> both")
    anna.keyboard.press("Enter")
    until(lambda: bob.locator(f"#tree {name}").text_content() == "<i>raise</i> both", PATIENCE_S)
    until(lambda: bob.locator("#log li", has_text="teacher").count(), PATIENCE_S, "who did it")
    bob.keyboard.press("u")
    note(bob, "undone")
    until(lambda: anna.locator(f"#tree {name}").text_content() == f"P{id}", PATIENCE_S)
    anna.keyboard.press("Escape")
    anna.keyboard.press("r")
    until(lambda: bob.locator(f"#tree {name}").text_content() == "<i>raise</i> both", PATIENCE_S)
    bob.reload()
    known(bob)
    assert bob.locator(f"#tree {name}").text_content() == "<i>raise</i> both"


def test_learning_is_paused_and_goes_on(address, new_page):
    page = known(new_page(address))
    page.click("#pause")
    until(lambda: "paused" in page.locator("#state").inner_text(), PATIENCE_S)
    assert page.locator("#pause").inner_text() == "Resume"
    page.click("#pause")
    until(lambda: "paused" not in page.locator("#state").inner_text(), PATIENCE_S)


def test_two_are_one_and_that_is_undone(address, new_page):
    page = known(new_page(address))
    page.click("#pause")  # so that nothing else changes
    until(lambda: "paused" in page.locator("#state").inner_text(), PATIENCE_S)
    page.wait_for_timeout(500)
    ids = [rows(page).nth(k).get_attribute("data-id") for k in (2, 3)]
    rows(page).nth(2).click()
    page.keyboard.press("m")
    page.locator(f'#tree [data-id="{ids[1]}"]').click()
    until(lambda: page.locator(f'#tree [data-id="{ids[1]}"]').count() == 0, PATIENCE_S)
    page.keyboard.press("u")
    until(lambda: page.locator(f'#tree [data-id="{ids[1]}"]').count() == 1, PATIENCE_S)
    page.click("#pause")


def test_one_is_two_and_one_is_forgotten(address, new_page):
    page = known(new_page(address), 6)
    page.click("#pause")
    until(lambda: "paused" in page.locator("#state").inner_text(), PATIENCE_S)
    page.wait_for_timeout(500)
    before, notes = rows(page).count(), page.locator("#notes")

    def split():
        return rows(page).count() == before + 1

    for many in page.locator("#tree .row.sure").all():  # the first that was shown often enough
        few = f"primitive {many.get_attribute('data-id')} has no two groups"
        many.click()
        page.keyboard.press("d")
        until(
            lambda few=few: split() or few in notes.inner_text(),
            PATIENCE_S,
            "two of one, or too few",
        )
        if split():
            break
    assert split()
    page.keyboard.press("u")
    until(lambda: rows(page).count() == before, PATIENCE_S)
    gone = rows(page).nth(1).get_attribute("data-id")
    rows(page).nth(1).click()
    page.keyboard.press("Delete")
    until(lambda: page.locator(f'#tree [data-id="{gone}"]').count() == 0, PATIENCE_S)
    assert not page.locator("#card").is_visible()
    page.keyboard.press("u")
    until(lambda: page.locator(f'#tree [data-id="{gone}"]').count() == 1, PATIENCE_S)
    page.click("#pause")


def test_the_robot_walks_goes_and_stops(address, new_page):
    page = known(new_page(address), 6)
    page.fill("#length", "12")
    page.click("#walk")
    until(lambda: page.get_attribute("html", "data-robot"), PATIENCE_S, "the robot walks")
    page.click("#stop")
    until(lambda: not page.get_attribute("html", "data-robot"), PATIENCE_S, "the robot stops")
    rows(page).nth(2).click()
    page.keyboard.press("o")
    until(lambda: page.locator("#notes div").count() > 0, PATIENCE_S)


def test_experiment_4_1_of_the_paper(chromium):
    """Four primitives are taught, then their order: figures 6 and 7 of [Kulic2012]."""
    found = session(chromium, speed=10, begin=drawn_seldom)
    assert found["learned"] == (4, 0)
    assert sorted(found["meanings"].values()) == sorted(NAMES.values())
    assert sorted(found["tree"]) == sorted(NAMES.values())
    assert sorted(found["graph"]) == sorted(NAMES.values())
    sure = [text for text in found["edges"] if text.startswith("1.00")]
    assert len(found["edges"]) == 6 and len(sure) == 2  # raise, lower; bend, return: then any


def test_a_learner_that_was_killed_goes_on_and_all_end_together(new_page, tmp_path):
    store = ("--store", str(tmp_path / "life.db"))
    with live("demonstrator:3", "--speed", "16", "--no-robot", *store) as (url, process):
        page = known(new_page(url), 3)
        state, id = page.locator("#state"), rows(page).first.get_attribute("data-id")
        rows(page).first.click()
        page.keyboard.press("n")
        page.keyboard.insert_text("mine")
        page.keyboard.press("Enter")
        name = page.locator(f'#tree [data-id="{id}"] text.name')
        until(lambda: name.text_content() == "mine", PATIENCE_S)
        state.evaluate(
            """state => {
                state.said = [];
                const note = () => state.said.push(state.dataset.live);
                new MutationObserver(note).observe(state, {attributeFilter: ["data-live"]});
            }"""
        )
        until(lambda: _learners(process.pid), PATIENCE_S, "the learner's process")[0].kill()
        until(lambda: "SIGKILL" in page.locator("#log").text_content(), PATIENCE_S)
        until(lambda: "no" in state.evaluate("state => state.said"), PATIENCE_S, "no longer live")
        until(lambda: state.get_attribute("data-live") == "yes", PATIENCE_S, "live again")
        assert name.text_content() == "mine"
        n = rows(page).count()
        until(lambda: rows(page).count() > n or page.locator("#log .learned").count(), PATIENCE_S)
        children = psutil.Process(process.pid).children(recursive=True)
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0
        assert not psutil.wait_procs(children, timeout=10)[1]


def _learners(pid):
    """Return the processes in which a server learns."""
    children = psutil.Process(pid).children(recursive=True)
    return [child for child in children if any("spawn_main" in word for word in child.cmdline())]
