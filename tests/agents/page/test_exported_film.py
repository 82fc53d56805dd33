"""The film that ``mplearn export --to html`` writes, in a browser, from a file."""

import json

import numpy as np

from benchmarks.teaching_session import until
from mplearn_envs.export import RobotModel, RobotMotion, Span, format_of, perform
from mplearn_envs.robot import humanoid


def shown_s(page):
    """Return what the clock of a film shows; its policy lets nothing wait inside the page."""
    return page.evaluate("parseFloat(document.getElementById('clock').textContent)")


def test_a_film_shows_what_the_robot_does(new_page, tmp_path):
    model = RobotModel.of(humanoid())
    (motion,) = perform(None, humanoid(), ("bow down",), speed=1.0).motions
    path = tmp_path / "bow.html"
    format_of("html").write(path, [motion], model)
    page = new_page(path.as_uri())
    until(lambda: shown_s(page) > 0.1, 10, "the film plays")
    page.emulate_media(reduced_motion="reduce")
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.reload()  # now it waits to be played
    assert page.inner_text("#play") == "Play"
    page.click("#play")
    until(lambda: shown_s(page) > 0.1, 10, "the film plays")
    page.evaluate("film.pause()")
    for frame in (0, len(motion) // 2, len(motion) - 1):
        there = page.evaluate(f"film.bodiesAt({frame}).map((body) => body.p)")
        part = slice(frame, frame + 1)
        posture = (motion.root_pos[part], motion.root_quat[part], motion.joint_pos[part])
        np.testing.assert_allclose(there, model.forward(*posture).pos[0], atol=1e-5)
    assert page.inner_text("#now") == "hold"
    page.click("#spans button >> nth=0")
    assert page.inner_text("#now") == "bow down"
    painted = page.evaluate(
        "(() => { const c = document.getElementById('stage'), d = c.getContext('2d')"
        ".getImageData(0, 0, c.width, c.height).data; const seen = new Set();"
        "for (let i = 0; i < d.length; i += 4) seen.add((d[i] << 16) + (d[i + 1] << 8) + d[i + 2]);"
        "return seen.size; })()"
    )
    assert painted > 50  # shaded faces
    assert asked == [path.as_uri()]  # nothing else is loaded
    policy = page.get_attribute("meta[http-equiv]", "content")
    assert policy.startswith("default-src 'none'; script-src 'sha256-")


def test_names_cannot_become_a_page(tmp_path):
    name = "</script><script>alert(1)</script>@STYLE@ @MOTION@"
    still = np.zeros((3, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)), np.zeros((3, 30))
    model = RobotModel.of(humanoid())
    motion = RobotMotion(name, model.joint_names, 50.0, *still, (Span(1, name, 0.0, 0.04),))
    path = tmp_path / "film.html"
    format_of("html").write(path, [motion], model)
    page = path.read_text("utf-8")
    assert page.count("<script") == 2 and "alert(1)</script>" not in page
    data = page.split('id="motion">')[1].split("</script>")[0]
    assert json.loads(data)["name"] == name
