from contextlib import ExitStack

import pytest


@pytest.fixture(scope="module")  # while it is open no other event loop runs in this thread
def chromium():
    """A headless browser; without one, its tests are skipped."""
    pytest.importorskip("playwright.sync_api", reason="needs playwright, of the extra 'dev'")
    pytest.importorskip("uvicorn", reason="needs the extra 'ui'")
    from benchmarks.teaching_session import browser
    from benchmarks.teaching_session import chromium as found

    if found() is None:
        pytest.skip("there is no chromium here: apt-get install chromium")
    with ExitStack() as stack:
        try:
            opened = stack.enter_context(browser())
        except Exception as error:  # of playwright: a machine on which no browser can run
            pytest.skip(f"chromium does not start here: {str(error).splitlines()[0]}")
        yield opened


@pytest.fixture
def new_page(chromium, request):
    """Open pages on which nothing goes wrong unseen; a module says whether ``DRAWN_SELDOM``."""
    from benchmarks.teaching_session import drawn_seldom

    seldom = getattr(request.module, "DRAWN_SELDOM", False)
    opened, errors = [], []

    def wrong(message):  # of lost connections the browser itself complains
        return message.type == "error" and "WebSocket connection" not in message.text

    def make(url, width=1280, height=720, theme="light"):
        context = chromium.new_context(viewport={"width": width, "height": height})
        context.add_init_script(f"localStorage.theme ||= '{theme}'")
        page = context.new_page()
        if seldom:
            drawn_seldom(page)
        opened.append(context)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda m: errors.append(m.text) if wrong(m) else None)
        page.goto(url)
        return page

    yield make
    for context in opened:
        context.close()
    assert not errors
