"""The HTML report: self-contained, inert, and in a real browser both pictures are there and nothing runs."""

import base64
import dataclasses
import hashlib
import http.server
import itertools
import re
import shutil
import subprocess
import threading
from html.parser import HTMLParser

import grading_samples as samples
import pytest

from muslin.grading import simulating, views
from muslin.grading.record import FAILED

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
BROWSER = next((path for name in BROWSERS if (path := shutil.which(name))), None)
in_a_browser = pytest.mark.skipif(
    BROWSER is None, reason=f"no browser on PATH (looked for {', '.join(BROWSERS)})"
)

#: What the report is made of; no script, form, frame, link to a file, or anything else that loads.
TAGS = """
html head meta title style body header main section nav footer div h1 h2 h3 h4 p a strong span code pre i
details summary dl dt dd figure figcaption img svg g clippath rect line polyline text
"""
VOID = {"meta", "img"}


class Page(HTMLParser):
    """What is in a page, and whether every tag is closed."""

    def __init__(self, text: str):
        super().__init__()
        self.tags: list[tuple[str, dict]] = []
        self.open: list[str] = []
        self.words: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        assert len(attributes) == len(dict(attributes)), f"an attribute twice in <{tag}>"
        self.tags.append((tag, dict(attributes)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)

    def all(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]


@pytest.fixture(scope="module", params=samples.SAMPLES)
def record(request):
    return samples.SAMPLES[request.param]()


@pytest.fixture(scope="module")
def report(record):
    return views.render(record, "html", quality="draft")


def test_the_page_is_made_of_known_tags_that_are_closed(report):
    page = Page(report)
    assert not page.open
    assert {tag for tag, _ in page.tags} <= set(TAGS.split())


def test_nothing_in_the_page_can_run_or_load(report):
    page = Page(report)
    for _, attributes in page.tags:
        assert not any(name.startswith("on") for name in attributes)
        assert all(value is not None or name == "open" for name, value in attributes.items())
    assert all(a["href"].startswith("#task-") for a in page.all("a"))
    assert all(image["src"].startswith("data:image/png;base64,") for image in page.all("img"))
    policy = page.all("meta")[1]
    assert policy["http-equiv"] == "Content-Security-Policy"
    assert policy["content"].startswith("default-src 'none'; style-src 'unsafe-inline'; img-src data:;")
    assert "url(" not in re.sub(r"url\(#clip-\w+\)", "", report)


def test_ids_are_there_once_and_links_lead_somewhere(report):
    page = Page(report)
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert {a["href"][1:] for a in page.all("a")} <= set(ids)


def test_pictures_and_plots_have_words_for_those_who_cannot_see_them(report):
    page = Page(report)
    assert all(image["alt"] for image in page.all("img"))
    assert all(svg["role"] == "img" and svg["aria-label"] for svg in page.all("svg"))
    assert page.all("html")[0]["lang"] == "en"


def test_headings_leave_out_no_level(report):
    levels = [int(tag[1]) for tag, _ in Page(report).tags if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))


def test_failed_tasks_are_open_and_the_others_closed():
    page = Page(views.render(samples.mixed(), "html", quality="none"))
    opened = [number for number, task in enumerate(page.all("details"), 1) if "open" in task]
    failed = [n for n, task in enumerate(samples.mixed().tasks, 1) if task.status in (FAILED, "error")]
    assert opened == failed


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"positions": ((float("nan"),) * 3,) * 576}, "blown up"),
        ({"positions": ((1e9, 0.0, 0.0),) * 576}, "flown apart"),
        ({"positions": ()}, "no run to show"),
        ({"positions": ((0.0, 0.0, 0.0),)}, "do not fit together"),
        ({"positions": ((0.0, 0.0),) * 576}, "shape"),
        ({"triangles": ((0, 1, 99999),)}, "vertices that do not exist"),
        ({"triangles": ((0, 1, 2),) * 200_001}, "200001 rows"),
        ({"scene": "<script>"}, "no scene"),
        ({"energies": ((0.0, 1.0, 1.0, 1.0), (float("inf"), 1e300, float("nan"), None))}, "Elastic energy"),
        ({"energies": ((0.0, 1e30, 1.0, 1.0),) * 2}, "leaves the plot"),
        ({"energies": (), "reference_energies": ((0.0, 1.0, 1.0, 1.0),)}, "Elastic energy"),
        ({"momenta": ((0.0, 1.0, float("nan"), None, 1e300, 0.0),) * 3}, "Linear momentum py"),
        ({"momenta": (), "reference_momenta": ((1.0,) * 6,)}, "Angular momentum lz"),
    ],
)
def test_a_simulation_that_cannot_be_drawn_does_not_cost_the_report(change, said):
    record = samples.mixed()
    record = dataclasses.replace(record, simulation=dataclasses.replace(record.simulation, **change))
    text = views.render(record, "html", quality="draft")
    assert said in text
    assert not Page(text).open


def test_energies_and_momenta_are_drawn_and_what_should_be_zero_is_not_drawn_as_if_it_moved():
    page = Page(views.render(samples.mixed(), "html", quality="none"))
    plots = {svg["aria-label"].split(" over time")[0]: svg for svg in page.all("svg") if "aria-label" in svg}
    assert [*plots] == [
        *(f"{name} energy" for name in ("kinetic", "elastic", "gravity", "total")),
        *(f"linear momentum p{axis}" for axis in "xyz"),
        *(f"angular momentum l{axis}" for axis in "xyz"),
    ]
    lines = [line["points"] for line in page.all("polyline")]
    heights = [float(point.split(",")[1]) for point in lines[2 * 6].split()]  # pz of the reference
    assert max(heights) - min(heights) < 1


def test_a_renderer_that_fails_does_not_cost_the_report(monkeypatch):
    monkeypatch.setattr("muslin.render.draw", lambda *_: 1 / 0)
    assert "the renderer failed (ZeroDivisionError)" in views.render(samples.mixed(), "html")


def test_without_a_run_there_are_no_pictures():
    text = views.render(samples.skipped(), "html")
    assert "student-picture" not in text
    assert "Skipped: it needs deformation_gradient" in text


# In a real browser -----------------------------------------------------------------------------------------

#: Run in the page when it has loaded: are the pictures decoded, of many colours, and did anything else run?
PROBE = """
addEventListener("load", () => {
  const said = [];
  for (const id of ["student-picture", "reference-picture"]) {
    const picture = document.getElementById(id), canvas = document.createElement("canvas");
    canvas.width = picture.naturalWidth;
    canvas.height = picture.naturalHeight;
    const pen = canvas.getContext("2d");
    pen.drawImage(picture, 0, 0);
    const colours = new Set(new Uint32Array(pen.getImageData(0, 0, canvas.width, canvas.height).data.buffer));
    said.push(id + ":" + canvas.width + "x" + canvas.height + (colours.size > 500 ? "" : ":blank"));
  }
  said.push("plots:" + document.querySelectorAll("#energy-plot svg polyline").length);
  said.push("hacked:" + String(window.hacked), "scripts:" + document.scripts.length);
  said.push("wide:" + (document.documentElement.scrollWidth > innerWidth));
  document.documentElement.setAttribute("data-probe", said.join(" "));
});
"""


@pytest.fixture
def home():
    """Address of a server that notes every request; `requests` of it."""
    requests = []

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            requests.append(self.path)
            self.send_error(404)

        do_POST = do_HEAD = do_GET

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}", requests
    server.shutdown()
    server.server_close()


def opened(page: str, tmp_path) -> tuple[str, list[str]]:
    """The page as a browser has it after loading, and what its console says."""
    file = tmp_path / "report.html"
    file.write_text(page, encoding="utf-8")
    done = subprocess.run(
        [
            BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
            "--disable-background-networking", "--disable-component-update", "--disable-extensions",
            "--enable-logging=stderr", "--window-size=1200,900", f"--user-data-dir={tmp_path / 'profile'}",
            "--timeout=20000", "--virtual-time-budget=5000", "--dump-dom", file.as_uri(),
        ],
        capture_output=True, text=True, encoding="utf-8", errors="replace", timeout=120, check=False,
    )  # fmt: skip
    assert done.stdout, done.stderr
    return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]


def allowing(page: str, script: str) -> str:
    """The page with a script in it that its policy allows, and the policy otherwise unchanged."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    probed = page.replace("default-src 'none';", f"default-src 'none'; script-src 'sha256-{digest}';", 1)
    probed = probed.replace("</head>", f"<script>{script}</script></head>", 1)
    assert probed.count(script) == 1
    return probed


def without_policy(page: str) -> str:
    return re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", page, count=1)


@in_a_browser
@pytest.mark.parametrize("guard", ["policy", "escapes alone"])
def test_hostile_text_does_nothing_and_both_pictures_are_shown(guard, home, tmp_path):
    address, requests = home
    page = views.render(samples.nasty(address), "html")
    probed = allowing(page, PROBE) if guard == "policy" else without_policy(allowing(page, PROBE))
    dom, console = opened(probed, tmp_path)
    said = re.search(r'data-probe="([^"]*)"', dom)[1].split()
    assert said == [
        "student-picture:640x480", "reference-picture:640x480", "plots:8", "hacked:undefined", "scripts:1", "wide:false"
    ]  # fmt: skip
    assert "<title>Cloth: finite elements on surfaces: 9.5 of 100</title>" in dom
    assert console == []
    assert requests == []


@in_a_browser
def test_the_page_as_it_is_loads_without_an_error(home, tmp_path):
    address, requests = home
    dom, console = opened(views.render(samples.nasty(address), "html"), tmp_path)
    assert console == []
    assert requests == []
    assert "hacked</title>" not in dom


@in_a_browser
def test_the_policy_would_stop_a_script_that_slipped_through(home, tmp_path):
    address, requests = home
    planted = (
        f"<script>document.title='hacked'</script><img src=x onerror=\"document.title='hacked'\">"
        f"<img src='{address}/pixel'><link rel=stylesheet href='{address}/style'>"
        f"<iframe src='{address}/frame'></iframe>"
    )
    page = views.render(samples.stubs(), "html").replace("<main>", f"<main>{planted}", 1)
    dom, console = opened(page, tmp_path)
    assert "<title>Cloth" in dom
    assert requests == []
    assert any("Content Security Policy" in line for line in console)
    dom, _ = opened(without_policy(page), tmp_path)  # the test itself sees what it looks for
    assert "<title>hacked</title>" in dom
    assert requests


def test_the_report_of_a_solid_speaks_of_a_solid():
    cloth, run = samples.mixed(), simulating.reference("solids")
    shape = {
        "triangles": run["triangles"],
        "positions": run["positions"],
        "reference_positions": run["positions"],
    }
    there = {name: tuple(map(tuple, table.tolist())) for name, table in shape.items()}
    beam = dataclasses.replace(cloth.simulation, scene="beam", **there)
    solid = dataclasses.replace(cloth, assignment={**cloth.assignment, "name": "solids"}, simulation=beam)
    for record, word, folds in ((cloth, "cloth", True), (solid, "solid", False)):
        text = views.render(record, "html", quality="draft")
        assert f"Your {word}" in text
        assert f"The {word} at the end of the scene {record.simulation.scene}" in text
        assert ("Draping" in text) == folds
