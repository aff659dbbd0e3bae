"""The viewer in a real browser: what is seen is the cloth, and the mouse pulls it."""

import time

import numpy as np
import pytest
from PIL import Image, ImageDraw

from conftest import sheet
from drape import Material
from drape.viewer import Window
import browser as pages
from browser import Browser, wait_for

WIDTH, HEIGHT = 1600, 700
VIEW = slice(360, 1240)  # columns beside messages and controls
SIDE = 16
LIKENESS = 0.95  # of what is seen with what is expected: the rest are edges and the pixels around pins


@pytest.fixture
def window(session, free_port):
    cloths = session.create(sheet(SIDE, max_grips=1, material=Material(damping_per_s=2.0)))
    with Window([cloths], port=free_port) as window:
        yield window


@pytest.fixture
def browser(window, tmp_path):
    browser = Browser(tmp_path, WIDTH, HEIGHT)
    try:
        browser.open(window.url)
        wait_for(lambda: len(window.server.get_clients()) == 1)
        yield browser
    finally:
        browser.close()


def on_screen(window, points):
    return pages.on_screen(window, points, WIDTH, HEIGHT)


def likeness(window, picture):
    """Of the blue pixels with those that the triangles cover: common ones, as a share of all. 1: the same."""
    cloths = window.batches[0]
    drawn = Image.new("1", (WIDTH, HEIGHT))
    corners = on_screen(window, cloths.positions[0].astype(float))
    for triangle in cloths.topology().triangles:
        ImageDraw.Draw(drawn).polygon([tuple(corners[k]) for k in triangle], fill=1, outline=1)
    expected = np.asarray(drawn)[:, VIEW]
    red, _, blue = (picture[:, VIEW, k].astype(int) for k in range(3))
    seen, is_pin = blue - red > 20, red - blue > 60
    seen, expected = seen & ~is_pin, expected & ~is_pin
    assert expected.sum() > 10_000
    return (seen & expected).sum() / (seen | expected).sum()


def wait_for_the_picture(window, browser):
    """Nothing moves now: the browser shows it soon."""
    seen = []

    def is_shown():
        seen.append(likeness(window, browser.picture()))
        return seen[-1] > LIKENESS

    wait_for(is_shown, seen)


@pytest.mark.full
def test_a_drag_of_the_mouse_moves_the_cloth_that_is_seen(window, browser):
    cloths = window.batches[0]
    wait_for_the_picture(window, browser)
    first = browser.picture()
    particle = 12 * SIDE + 6
    start = cloths.positions[0].astype(float)
    pointer = on_screen(window, start[[particle]])[0]
    browser.mouse("mouseMoved", pointer, shift=True)
    time.sleep(0.5)  # what is under the pointer is found between two pictures
    browser.mouse("mousePressed", pointer, shift=True)
    for _ in range(15):
        pointer = pointer - [4, 8]
        browser.mouse("mouseMoved", pointer, shift=True, holds=True)
        time.sleep(0.05)

    def away():
        return np.linalg.norm(on_screen(window, cloths.positions[0, [particle]].astype(float))[0] - pointer)

    # The hit is on the surface, a fraction of an edge beside the particle.
    edge_px = np.linalg.norm(np.diff(on_screen(window, start[[particle, particle + 1]]), axis=0))
    wait_for(lambda: away() < edge_px)
    assert cloths.positions[0, particle, 1] - start[particle, 1] > 0.1  # up, against gravity
    browser.mouse("mouseReleased", pointer, shift=True)
    wait_for(lambda: window._pulled is None)
    with window._lock:  # the picture in which the cloth was released has its steps
        before = int(cloths.step_count[0])
    time.sleep(0.5)
    assert cloths.step_count[0] == before  # and everything stops
    wait_for_the_picture(window, browser)
    assert (np.abs(browser.picture()[:, VIEW].astype(int) - first[:, VIEW]).max(2) > 50).sum() > 1000

    browser.press_button("step")
    wait_for(lambda: cloths.step_count[0] == before + 1)
    browser.press_button("play")
    wait_for(lambda: cloths.step_count[0] > before + 10)
    browser.press_button("play")
    wait_for(lambda: not window.play.value)
    wait_for_the_picture(window, browser)
    browser.press_button("reset")
    wait_for(lambda: cloths.step_count[0] == 0)
    wait_for_the_picture(window, browser)
    assert likeness(window, first) > LIKENESS  # the same as at first


@pytest.mark.full
def test_a_recording_plays_by_itself(window, browser, tmp_path):
    """One file, without the server."""
    wait_for_the_picture(window, browser)
    seen = browser.picture()
    window.start_recording()
    window.ask_step(3)
    wait_for(lambda: window.batches[0].step_count[0] == 3)
    time.sleep(0.2)
    window.save_recording(tmp_path / "recording.html")
    window.close()
    browser.open("file://" + str(tmp_path / "recording.html"))
    blue = (seen[:, VIEW, 2].astype(int) - seen[:, VIEW, 0] > 20).sum()

    def shows_a_cloth():
        now = browser.picture()[:, VIEW]
        return (now[..., 2].astype(int) - now[..., 0] > 20).sum() > blue / 2

    wait_for(shows_a_cloth)
