"""The controls of the window, worked by the mouse and the keys of a real browser."""

import time

import numpy as np
import pytest

from browser import Browser, on_screen, wait_for
from conftest import sheet
from drape import Collider, Environment, Material, Sphere
from drape.viewer import Window
from drape.viewer.surroundings import own

WIDTH, HEIGHT = 1600, 700
VIEW = slice(360, 1240)  # columns beside messages and controls
WIND = [6, 0, 0.3]
BALL = np.array([-0.4, 0, 0.5])
DARK, RED = (68, 1, 84), (178, 24, 43)  # of no speed and of the deepest stretch
SELECT_ALL = "document.activeElement.select()"


@pytest.fixture
def cloths(session):
    surroundings = Environment(wind_m_per_s=WIND, colliders=[Collider(sphere=Sphere(center_m=BALL, radius_m=0.2))])
    return session.create(sheet(16, environment=surroundings, material=Material(air_drag=1.0)))


@pytest.fixture
def window(cloths, free_port):
    with Window([cloths], tracks_colliders=True, port=free_port) as window:
        yield window


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    browser = Browser(tmp_path_factory.mktemp("chromium"), WIDTH, HEIGHT)
    yield browser
    browser.close()


@pytest.fixture
def browser(window, chromium):
    chromium.open(window.url)
    wait_for(lambda: len(window.server.get_clients()) == 1)
    wait_for(lambda: is_cloth(chromium).sum() > 10_000)
    return chromium


def view(browser):
    return browser.picture()[:, VIEW].astype(int)


def is_cloth(browser):
    seen = view(browser)
    return seen[..., 2] - seen[..., 0] > 20


def count(browser, colour):
    """Pixels of this colour."""
    return (np.abs(view(browser) - colour).max(2) < 12).sum()


def choose(browser, label, option):
    browser.click(browser.beside(label, "input:not([type=hidden])")[0])
    wait_for(lambda: option in [text for _, text in browser.places("[role=option]")])
    ((x, y, width, height),) = [box for box, text in browser.places("[role=option]") if text == option]
    browser.click((x + width / 2, y + height / 2))


def environment(cloths):
    return [own(name, cloths.describe(0)).tolist() for name in ("gravity", "wind")]


@pytest.mark.full
def test_colours(window, browser, cloths):
    assert count(browser, DARK) < 100
    choose(browser, "colour by", "speed")
    wait_for(lambda: count(browser, DARK) > 5000)  # at rest
    assert "largest speed" in window.status.content
    window.ask_step(3)
    choose(browser, "colour by", "strain")
    wait_for(lambda: count(browser, RED) > 20)
    assert count(browser, DARK) < 100 and "largest strain" in window.status.content
    choose(browser, "colour by", "cloth")
    wait_for(lambda: count(browser, RED) == 0 and is_cloth(browser).sum() > 10_000)


@pytest.mark.full
def test_gravity_and_wind(window, browser, cloths):
    gravity, wind = [0, -9.81, 0], WIND
    assert environment(cloths) == [gravity, wind]
    (thumb,) = browser.beside("gravity [m/s²]", "[role=slider]")
    number = browser.beside("gravity [m/s²]", "input:not([type=hidden])")[-1]
    browser.click(((thumb[0] + number[0]) / 2, thumb[1]))  # to the right on its track: upwards
    wait_for(lambda: environment(cloths)[0][1] > 0)
    gravity = [0, pytest.approx(window.surroundings.gravity.value), 0]
    assert environment(cloths) == [gravity, WIND]
    browser.click(number)
    browser.run(SELECT_ALL)
    browser.ask("Input.insertText", text="5")
    browser.press("Enter", 13)
    wait_for(lambda: environment(cloths) == [[0, 5, 0], WIND])
    browser.click(browser.beside("wind [m/s]", "input")[0])
    browser.run(SELECT_ALL)
    browser.ask("Input.insertText", text="-7.5")
    browser.press("Enter", 13)
    wait_for(lambda: environment(cloths) == [[0, 5, 0], [-7.5, 0, 0.3]])
    browser.press_button("play")
    wait_for(lambda: cloths.step_count[0] > 20)
    browser.press_button("play")
    wait_for(lambda: not window.play.value)
    assert cloths.positions[0, :, 1].mean() > 0.05  # it rises
    assert cloths.positions[0, :, 0].mean() < 0.5  # before the wind


@pytest.mark.full
def test_colliders_are_where_they_are(window, browser, cloths):
    def is_grey(place):
        x, y = on_screen(window, np.array([place]), WIDTH, HEIGHT)[0]
        red, green, blue = browser.picture()[round(y), round(x)].astype(int)
        return max(red, green, blue) - min(red, green, blue) < 20 and 60 < green < 240

    wait_for(lambda: is_grey(BALL))
    moved = BALL + [0, 0.45, 0]
    assert not is_grey(moved)
    cloths.move_colliders([0], [moved])
    browser.press_button("step")
    wait_for(lambda: cloths.step_count[0] == 1)
    wait_for(lambda: is_grey(moved) and not is_grey(BALL))


@pytest.mark.full
def test_record_saves_a_file_that_plays(window, browser, cloths, tmp_path):
    browser.ask("Page.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    blue = is_cloth(browser).sum()
    browser.press_button("record")
    wait_for(lambda: "stop and save" in [text for _, text in browser.places("button")])
    for steps in (1, 2, 3):
        browser.press_button("step")
        wait_for(lambda steps=steps: cloths.step_count[0] == steps)
    time.sleep(0.2)  # the last picture
    browser.press_button("stop and save")
    file = tmp_path / "drape.html"
    wait_for(lambda: file.exists() and file.stat().st_size > 100_000)
    wait_for(lambda: "record" in [text for _, text in browser.places("button")])
    window.close()
    browser.open(f"file://{file}")
    wait_for(lambda: is_cloth(browser).sum() > blue / 2)
