"""The page in a real browser, shown a world that is made up."""

import itertools
import json
import time

import numpy as np
import pytest

pytest.importorskip("uvicorn", reason="needs the extra 'ui'")
import page_world as world
from page_server import served

from benchmarks.teaching_session import until
from mplearn_agents.page import messages


@pytest.fixture(scope="module")
def server():
    with served() as found:
        yield found


@pytest.fixture
def shown(server, new_page):
    """A page on which 300 primitives are known."""
    server.hear(world.bodies())
    server.hear(world.stream())
    server.hear(world.knowledge(300))
    page = new_page(server.url)
    until(lambda: page.locator("#tree .row").count() == 300, 10)
    return page


def rows(page):
    return page.locator("#tree .row")


def what_is_sent(page):
    """Return what says all that a page sends from its next connection on."""
    sent = []
    page.on("websocket", lambda socket: socket.on("framesent", lambda text: sent.append(text)))

    def so_far():
        page.evaluate("0")  # who waits without asking the page hears nothing of it
        return sent

    return so_far


def test_300_primitives_are_legible(server, shown):
    """Each has a line of its own in the tree; the graph shows what is around one."""
    boxes = shown.evaluate(
        "[...document.querySelectorAll('#tree .row text.name')]"
        ".map((e) => { const b = e.getBoundingClientRect(); return [b.top, b.bottom]; })"
    )
    boxes = sorted(boxes)
    assert all(b[0] >= a[1] - 4 for a, b in itertools.pairwise(boxes))
    assert shown.get_attribute("#around", "aria-pressed") == "true"
    rows(shown).nth(5).click()
    until(lambda: 2 <= shown.locator("#graph .node").count() <= 20, 5)
    labels = shown.evaluate(
        "[...document.querySelectorAll('#graph .node text')]"
        ".map((e) => e.getBoundingClientRect()).map((b) => [b.x, b.y, b.width, b.height])"
    )
    for i, (x, y, w, h) in enumerate(labels):
        for x2, y2, w2, h2 in labels[:i]:
            apart = x + w <= x2 or x2 + w2 <= x or y + 0.7 * h <= y2 or y2 + 0.7 * h2 <= y
            assert apart, "names must not cover each other"


def test_it_rests_while_nothing_moves(shown):
    """A page that is left open costs a machine next to nothing; touched, it is awake at once."""
    rate = "Number(document.documentElement.dataset.fps)"
    shown.mouse.move(200, 200)
    until(lambda: 0 < shown.evaluate(rate) <= 6, 15, "a few pictures a second")
    steps = itertools.count()

    def awake():
        shown.mouse.move(200 + next(steps) % 200, 200)
        return shown.evaluate(rate) > 6

    until(awake, 15, "as many as can be drawn")


def test_the_tree_folds_and_is_searched(shown):
    inner = shown.locator("#tree [data-fold]")
    n, before = inner.count(), rows(shown).count()
    inner.first.click()
    until(lambda: rows(shown).count() < before, 5)
    shown.click("#fold")
    until(lambda: rows(shown).count() == 0, 5)
    assert inner.count() == n
    shown.click("#fold")
    until(lambda: rows(shown).count() == before, 5)
    shown.keyboard.press("/")
    shown.keyboard.type("P29")
    until(lambda: rows(shown).count() == 11, 5)  # P29 and P290 to P299
    shown.keyboard.press("Enter")
    assert shown.locator("#card").is_visible()
    assert shown.locator("#card input").input_value() == "P29"


def test_it_is_used_by_keyboard(shown):
    shown.keyboard.press("l")
    shown.keyboard.press("ArrowDown")
    shown.keyboard.press("ArrowDown")
    focused = "document.activeElement.dataset.id"
    assert shown.evaluate(focused) or shown.evaluate("document.activeElement.dataset.fold")
    shown.keyboard.press("End")
    id = shown.evaluate(focused)
    shown.keyboard.press("Enter")
    assert shown.locator("#card input").input_value() == f"P{id}"
    shown.keyboard.press("Escape")
    assert not shown.locator("#card").is_visible()
    shown.keyboard.press("?")
    assert shown.locator("#keys").is_visible()
    shown.keyboard.press("Escape")
    before = shown.get_attribute("html", "data-theme")
    shown.keyboard.press("t")
    assert shown.get_attribute("html", "data-theme") != before
    shown.keyboard.press("f")
    size = "parseFloat(getComputedStyle(document.querySelector('.present')).fontSize)"
    assert shown.evaluate(size) >= 40  # to be read from three metres
    shown.keyboard.press("f")


@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080)])
@pytest.mark.parametrize("screen", [False, True])
def test_all_fits_without_scrolling(server, new_page, size, screen):
    server.hear(world.bodies())
    server.hear(world.stream())
    server.hear(world.knowledge(20, world.HOSTILE))
    page = new_page(server.url, *size)
    if screen:
        page.keyboard.press("f")
    until(lambda: rows(page).count() == 20, 10)
    overflow = "[document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
    assert page.evaluate(overflow) == list(size)
    for id in ("stage", "stream", "graph", "tree", "now", "progress"):
        box = page.locator(f"#{id}").bounding_box()
        assert box["width"] > 100 and box["height"] > 25
        assert box["x"] >= 0 and box["x"] + box["width"] <= size[0]
        assert box["y"] >= 0 and box["y"] + box["height"] <= size[1]


def test_what_is_done_is_read_whole_beside_all_figures(server, new_page):
    """However much there is to say, whether it learns is not what is cut."""
    server.hear(
        {"kind": "status", "source": "lsl:" + "a stream with a long name " * 4, "paused": True}
        | {"state": "live", "rate_hz": 100.0, "delay_ms": 53406.2, "delay_99_ms": 60000.0}
        | {"behind_s": 325.31, "lost": 12, "faults": {"doubled": 3}, "frames": 1, "person": 1}
    )
    page = new_page(server.url)
    doing = page.locator("#state .doing")
    until(lambda: "learning is paused" in doing.text_content(), 5)
    assert doing.evaluate("(e) => e.scrollWidth <= e.clientWidth + 1")
    assert doing.bounding_box()["x"] > 150
    figures = page.locator("#figures").inner_text()
    assert "53406 ms" in figures and "325.3 s of motion" in figures
    frame = page.locator("#figures").bounding_box()
    for each in page.locator("#figures div").all():  # whole, or not at all
        box = each.bounding_box()
        assert box["x"] + box["width"] <= frame["x"] + frame["width"] + 1
        assert box["y"] < frame["y"] + 1 or box["y"] >= frame["y"] + frame["height"]
    waits = page.locator("#figures div", has_text="of motion").bounding_box()
    assert waits["y"] < frame["y"] + frame["height"]  # before the source's name
    server.hear({"kind": "status", "source": "made up", "state": "live", "frames": 1})


@pytest.mark.parametrize("size", [(390, 844), (768, 1024)])
def test_on_what_is_held_in_a_hand_panels_lie_below_each_other(server, new_page, size):
    server.hear(world.bodies())
    server.hear(world.stream())
    server.hear(world.knowledge(20, world.HOSTILE))
    page = new_page(server.url, *size)
    until(lambda: rows(page).count() == 20, 10)
    assert page.evaluate("document.documentElement.scrollWidth") == size[0]
    panels = ("stage", "stream", "now", "progress", "log", "graph", "tree")
    boxes = [page.locator(f"#{id}").bounding_box() for id in panels]
    for above, below in itertools.pairwise(boxes):
        assert above["y"] + above["height"] <= below["y"]
        assert above["width"] > 0.9 * size[0]
    for id in ("stage", "graph", "tree"):
        title, tools = (page.locator(f"#{id} > {what}") for what in ("h2", ".tools"))
        words = title.evaluate(
            "(e) => { const r = new Range(); r.selectNodeContents(e);"
            " return r.getBoundingClientRect().right; }"
        )
        assert words <= tools.bounding_box()["x"]


def test_a_key_for_the_chosen_one_says_where_none_is(server, new_page):
    server.hear(world.stream())
    server.hear(world.knowledge(3))
    page = new_page(server.url)
    until(lambda: rows(page).count() == 3, 10)
    page.keyboard.press("n")
    until(lambda: "Choose a primitive first" in page.locator("#notes").inner_text(), 5)


@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080)])
def test_names_in_the_whole_graph_lie_apart(server, new_page, size):
    names = [f"raise the arm, way {k}" for k in range(1, 13)]
    server.hear(world.stream())
    server.hear(world.knowledge(len(names), names))
    page = new_page(server.url, *size)
    texts = page.locator("#graph .node text")
    until(lambda: texts.count() == len(names), 10)

    def apart():
        boxes = [text.bounding_box() for text in texts.all()]
        return all(
            a["x"] + a["width"] <= b["x"] + 2
            or b["x"] + b["width"] <= a["x"] + 2
            or a["y"] + 0.7 * a["height"] <= b["y"]
            or b["y"] + 0.7 * b["height"] <= a["y"]
            for a, b in itertools.combinations(boxes, 2)
        )

    until(apart, 20, "names that do not cover each other")


def test_a_question_goes_when_it_is_answered(server, new_page):
    """Who says that two are one sees the tree that he chooses from, and is asked once."""
    server.hear(world.stream())
    server.hear(world.knowledge(12))
    page = new_page(server.url)
    until(lambda: rows(page).count() == 12, 10)
    rows(page).nth(3).click()
    page.keyboard.press("m")
    question = page.locator("#notes div", has_text="Choose it in tree or graph")
    until(lambda: question.count() == 1, 5)
    asked, tree = question.bounding_box(), page.locator("#tree").bounding_box()
    assert asked["x"] + asked["width"] <= tree["x"]
    rows(page).nth(11).scroll_into_view_if_needed()
    rows(page).nth(11).click()
    until(lambda: question.count() == 0, 5)
    page.keyboard.press("m")
    until(lambda: question.count() == 1, 5)
    page.keyboard.press("Escape")
    until(lambda: question.count() == 0, 5)


def test_a_long_name_does_not_cut_how_many_more_come(server, new_page):
    said = new_page(server.url).evaluate(
        """async () => {
          const { clipped } = await import("/stage.js");
          const c = document.createElement("canvas").getContext("2d");
          c.font = "16px sans-serif";
          return ["raise", "raise both arms, and lower them"].map((name) => {
            const text = clipped(c, name, 120, ", 12 more");
            return [text, c.measureText(text).width];
          });
        }"""
    )
    assert said[0][0] == "raise, 12 more"
    assert said[1][0].startswith("ra") and said[1][0].endswith("\u2026, 12 more")
    assert said[1][1] <= 120


def test_names_are_text_never_markup(server, new_page):
    server.hear(world.stream())
    server.hear(world.knowledge(len(world.HOSTILE), world.HOSTILE))
    page = new_page(server.url)
    page.on("dialog", lambda dialog: pytest.fail("a name was run"))
    until(lambda: rows(page).count() == len(world.HOSTILE), 10)
    titles = page.locator("#tree .row title").all_text_contents()
    assert {t.rsplit(", ", 1)[0] for t in titles} == set(world.HOSTILE)
    for id, name in enumerate(world.HOSTILE, start=1):
        server.hear({"kind": "event", "what": "born", "text": f"new: {{{id}}}", "time_s": 1.0})
        server.hear(world.segment(100 * id, 100 * id + 90, id))
        until(lambda name=name: page.locator(".present").text_content() == name, 5)
        first = page.locator("#log li").first
        until(lambda name=name, first=first: name in first.text_content(), 5)
    assert page.locator("img, script:not([src]), main b, iframe").count() == 0


def test_names_in_braces_stand_for_no_primitive(server, new_page):
    server.hear(world.stream())
    server.hear(world.knowledge(2, ["{2}", "wave"]))
    page = new_page(server.url)
    until(lambda: rows(page).count() == 2, 10)
    text = f"{messages.mention(2)} is called {messages.literal('{1} {{2}} {x}')} now"
    server.hear({"kind": "event", "what": "command", "text": text, "time_s": 1.0})
    first = page.locator("#log li").first
    until(lambda: "is called" in first.text_content(), 5)
    assert first.locator("span").text_content() == "wave is called {1} {{2}} {x} now"


def test_a_search_that_is_left_hides_nothing(server, new_page):
    server.hear(world.knowledge(12))
    page = new_page(server.url)
    until(lambda: rows(page).count() == 12, 10)
    page.keyboard.press("/")
    page.keyboard.insert_text("nobody")
    until(lambda: rows(page).count() == 0, 5)
    page.keyboard.press("Escape")
    until(lambda: rows(page).count() == 12, 5)
    assert page.input_value("#search") == ""


def test_it_says_what_is_present_next_and_rejected(server, new_page):
    server.hear(world.stream())
    server.hear(world.knowledge(5, ["bow down", "bow up", "squat", "kick", "wave"]))
    page = new_page(server.url)
    server.hear(world.segment(0, 90, 1))
    coming = [{"id": 2, "p": 0.82, "frame": 60}, {"id": None, "p": 0.1, "frame": None}]
    server.hear({"kind": "forecast", "next": coming})
    until(lambda: page.locator(".present").text_content() == "bow down", 5)
    assert page.locator('#tree .row.lit[data-id="1"]').count() == 1
    assert page.locator('#graph .node.lit[data-id="1"]').count() == 1
    first = page.locator(".next li").first
    until(lambda: "bow up" in first.inner_text() and "0.82" in first.inner_text(), 5)
    header, blob = world.live(0, 5)
    server.hear(header, blob)
    until(lambda: "in 0." in first.inner_text(), 5)
    server.hear(world.segment(90, 200, None, "unlike", "nearest is {3}, 1.6 times as far"))
    until(lambda: page.locator(".present").text_content() == "not recognised", 5)
    assert "nearest is squat, 1.6 times" in page.locator(".why").text_content()
    assert page.locator("#graph .node.lit").count() == 0


def test_progress_of_what_is_not_sure_yet(server, new_page):
    server.hear(world.stream())
    known = world.knowledge(7)
    known["waiting"] = {"n": 4, "times": 2, "of": 4}
    server.hear(known)
    page = new_page(server.url)
    progress = page.locator("#progress")
    until(lambda: "6 learned, 1 to be confirmed" in progress.inner_text(), 5)
    assert "P7" in progress.inner_text() and "2 of 3" in progress.inner_text()
    assert "a new motion" in progress.inner_text() and "2 of 4" in progress.inner_text()


def test_a_lost_connection_is_said_and_made_again(new_page):
    with served() as first:
        port = first.port
        first.hear(world.knowledge(4))
        page = new_page(first.url)
        until(lambda: rows(page).count() == 4, 10)
    until(lambda: page.locator("#lost").is_visible(), 5)
    with served(port=port) as second:
        second.hear(world.knowledge(6))
        until(lambda: rows(page).count() == 6, 15)
        assert not page.locator("#lost").is_visible()


def test_a_figure_is_shown_with_its_demonstrations(server, new_page):
    server.hear(world.bodies())
    server.hear(world.stream())
    server.hear(world.knowledge(3))
    page = new_page(server.url)
    sent = what_is_sent(page)
    page.reload()
    until(lambda: rows(page).count() == 3, 10)
    rows(page).first.click()
    until(lambda: any('"show"' in text for text in sent()), 5)
    asked = next(json.loads(text) for text in sent() if '"show"' in text)
    pose = np.repeat(world.standing()[None], 30, axis=0)
    clip = messages.clip(asked["ref"], 30.0, [pose, pose[:20], pose[:25]])
    number = max(client.number for client in server.hub.clients)
    server.hear({"kind": "clip", "client": number}, clip)
    until(lambda: page.get_attribute("html", "data-shown") == str(asked["ref"]), 5)


def test_who_moves_is_drawn_where_there_is_no_robot(new_page):
    """Without a robot's process who watches says what a person looks like."""
    ink = """() => { const c = document.querySelector("#stage canvas");
      const d = c.getContext("2d").getImageData(0, 0, c.width / 2, c.height * 0.6).data;
      let n = 0; for (let k = 0; k < d.length; k += 4) n += d[k] < 150; return n; }"""
    with served() as server:
        server.hear(world.stream())
        server.hear({"kind": "person", "shapes": world.bodies()["person"]})
        page = new_page(server.url)
        until(lambda: page.evaluate(ink) < 100, 20, "an empty stage")  # all ink until it is drawn
        server.hear(*world.live(0, 10))
        until(lambda: page.evaluate(ink) > 500, 20, "a person")
        assert page.get_attribute("html", "data-figures") is None
        server.hear(world.bodies())
        until(lambda: page.get_attribute("html", "data-figures") == "there", 20)


def test_what_is_not_allowed_is_said(server, new_page):
    """A reply that refuses is shown, as text."""
    server.hear(world.knowledge(3))
    page = new_page(server.url)
    until(lambda: rows(page).count() == 3, 10)
    page.evaluate("document.querySelector('#walk').disabled = false")
    number = max(client.number for client in server.hub.clients)
    sent = []
    server.hub._robot.send = lambda header, blob=b"": sent.append(header)
    page.keyboard.press("w")
    until(lambda: sent, 5)
    reply = {"kind": "reply", "client": number, "ref": sent[0]["ref"], "ok": False}
    server.hear(reply | {"text": "the robot cannot {1} <b>"})
    until(lambda: "the robot cannot P1 <b>" in page.locator("#notes").inner_text(), 5)


def test_it_draws_on_while_much_comes(server, new_page):
    """Nothing grows on the page when an hour of happenings has come."""
    server.hear(world.bodies())
    server.hear(world.stream())
    page = new_page(server.url)
    for k in range(30):
        server.hear(world.knowledge(40, revision=k))
        for n in range(20):
            text = f"{k} {n}"
            server.hear({"kind": "event", "what": "rejected", "text": text, "time_s": 1.0})
            server.hear(world.segment(100 * n, 100 * n + 90, 1 + n))
    until(lambda: page.locator("#log li").first.inner_text().endswith("29 19"), 10)
    assert page.locator("#log li").count() <= 200
    frames = page.evaluate("new Promise((r) => requestAnimationFrame(() => r(1)))")
    assert frames == 1
    time.sleep(0.1)


def test_what_cannot_be_undone_cannot_be_asked_to_be(server, new_page):
    """A teacher's note loses its Undo when another one has undone it; so do the buttons."""
    server.hear(world.stream())
    server.hear(world.knowledge(3))
    status = {"kind": "status", "source": "made up", "state": "live", "frames": 1}
    server.hear(status | {"undoable": [4, 6], "redoable": [], "entry": 6})
    page = new_page(server.url)
    sent = what_is_sent(page)
    page.reload()
    until(lambda: rows(page).count() == 3, 10)
    assert page.locator("#undo").is_enabled()
    assert not page.locator("#redo").is_enabled()
    rows(page).first.click()
    page.keyboard.press("Delete")
    until(lambda: any('"forget"' in text for text in sent()), 5)
    asked = next(json.loads(text) for text in sent() if '"forget"' in text)
    number = max(client.number for client in server.hub.clients)
    reply = {"kind": "reply", "client": number, "ref": asked["ref"], "ok": True, "entry": 7}
    server.hear(reply | {"text": "{1} is forgotten"})
    undo = page.locator("#notes button")
    until(lambda: undo.count() == 1, 5)  # the status was said before it
    server.hear(status | {"undoable": [4, 6, 7], "redoable": [], "entry": 7})
    undo.click()
    until(lambda: any('"undo"' in text for text in sent()), 5)
    assert next(json.loads(text) for text in sent() if '"undo"' in text)["entry"] == 7
    page.keyboard.press("Delete")
    until(lambda: sum('"forget"' in text for text in sent()) == 2, 5)
    ref = [json.loads(text)["ref"] for text in sent() if '"forget"' in text][-1]
    server.hear(reply | {"ref": ref, "entry": 9, "text": "{1} is forgotten"})
    until(lambda: undo.count() == 1, 5)
    server.hear(status | {"undoable": [], "redoable": [9], "entry": 10})
    until(lambda: undo.count() == 0, 5)
    assert page.locator("#notes div").count() == 1
    assert not page.locator("#undo").is_enabled()
    assert page.locator("#redo").is_enabled()


def test_in_the_tree_no_name_touches_how_often_it_was_shown(server, new_page):
    names = ["MMMMMWWWWW MMMMMWWWWW MMMMMWWWWW", "iiiiiiiiiiiiiiiiiiiiiiiiiiiii", "上げる" * 12]
    server.hear(world.stream())
    server.hear(world.knowledge(12, names * 4))
    page = new_page(server.url)
    for screen in (False, True):
        if screen:
            page.keyboard.press("f")
        until(lambda: rows(page).count() == 12, 10)
        for row in rows(page).all():
            name, count = (row.locator("text").nth(k).bounding_box() for k in (0, 1))
            assert name["x"] + name["width"] + 5 <= count["x"]
    page.keyboard.press("f")


def test_no_arrow_lies_under_the_name_that_it_points_to(server, new_page):
    names = [f"raise the arm, way {k}" for k in range(1, 9)]
    server.hear(world.stream())
    server.hear(world.knowledge(len(names), names))
    page = new_page(server.url, 1920, 1080)
    texts, tips = page.locator("#graph .node text"), page.locator("#graph .tip")
    until(lambda: texts.count() == len(names), 10)

    def clear():
        return page.evaluate(
            """() => [...document.querySelectorAll("#graph .tip")].every((tip) => {
              const name = document.querySelector(`#graph [data-id="${tip.dataset.to}"] text`);
              const a = tip.getBoundingClientRect(), b = name.getBoundingClientRect();
              return a.right <= b.left + 1 || b.right <= a.left + 1
                || a.bottom <= b.top + 3 || b.bottom - 3 <= a.top;
            })"""
        )

    assert tips.count() > 8
    until(clear, 20, "arrows that can be seen")
