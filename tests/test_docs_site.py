"""The documentation site: it builds without an error, and in a real browser it asks nobody for anything."""

import functools
import html
import http.server
import json
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

pytest.importorskip("mkdocs", reason='the docs extra is not installed: pip install -e ".[docs]"')
pytest.importorskip("latex2mathml", reason='the docs extra is not installed: pip install -e ".[docs]"')

ROOT = Path(__file__).resolve().parents[1]
HANDOUT = ROOT / "assignments" / "cloth" / "README.md"

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
BROWSER = next((path for name in BROWSERS if (path := shutil.which(name))), None)
in_a_browser = pytest.mark.skipif(
    BROWSER is None, reason=f"no browser on PATH (looked for {', '.join(BROWSERS)})"
)

PAGES = (
    "index.html",
    "handouts/cloth/index.html",
    "reference/index.html",
    "reference/commands.html",
    "grading.html",
    "deciding.html",
    "gallery.html",
    "integrity.html",
    "recipes/scene.html",
)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built strictly: a broken link, anchor or formula fails."""
    folder = tmp_path_factory.mktemp("site")
    command = [
        sys.executable,
        "-m",
        "mkdocs",
        "build",
        "--strict",
        "-f",
        "docs/site/mkdocs.yml",
        "-d",
        folder,
    ]
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return folder


@pytest.fixture(scope="module")
def hooks():
    """The hooks of the site, as a module."""
    from importlib.util import module_from_spec, spec_from_file_location

    spec = spec_from_file_location("docs_hooks", ROOT / "docs" / "site" / "hooks.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# The pages as files ----------------------------------------------------------------------------------------


def formulas(text: str) -> list[str]:
    """Formulas of a handout, found otherwise than the site finds them."""
    blocks = re.findall(r"^ *```math\n(.*?)^ *```$", text, re.MULTILINE | re.DOTALL)
    prose = re.sub(r"^ *```.*?^ *```$", "", text, flags=re.MULTILINE | re.DOTALL)
    prose = re.sub(r"`[^`\n]*`", "", prose)
    assert prose.count("$") % 2 == 0
    return blocks + prose.split("$")[1::2]


def outside_code(page: str) -> str:
    """Text of a page's article without code and formulas."""
    article = page[page.index("<article") : page.index("</article>")]
    for tag in ("pre", "code", "math"):
        article = re.sub(rf"<{tag}\b.*?</{tag}>", "", article, flags=re.DOTALL)
    return html.unescape(re.sub(r"<[^>]+>", "", article))


def test_every_formula_of_the_handout_becomes_mathml(site):
    page = (site / "handouts" / "cloth" / "index.html").read_text(encoding="utf-8")
    wanted = formulas(HANDOUT.read_text(encoding="utf-8"))
    assert len(wanted) > 400
    assert page.count("<math") == len(wanted)
    assert not re.search(r"\$|\\[a-zA-Z]", outside_code(page))
    assert "merror" not in page


def test_the_handout_on_the_site_is_the_one_students_get(site):
    page = outside_code((site / "handouts" / "cloth" / "index.html").read_text(encoding="utf-8"))
    flat = " ".join(page.split())
    text = re.sub(
        r"^ *```.*?^ *```$", "", HANDOUT.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL
    )
    sentences = [s for s in re.findall(r"(?<=[.:] )[A-Z][^.`$\[\]*<>|:]+\.", text) if "\n" not in s]
    assert len(sentences) > 50
    assert [s for s in sentences if " ".join(s.split()) not in flat] == []


def test_lists_and_tables_are_read_as_github_reads_them(site, hooks):
    page = (site / "handouts" / "cloth" / "index.html").read_text(encoding="utf-8")
    text = re.sub(
        r"^ *```.*?^ *```$", "", HANDOUT.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL
    )
    article = page[page.index("<article") : page.index("</article>")]
    assert article.count("<li>") == len(re.findall(r"^ *(?:[-*]|\d+\.) +\S", text, re.MULTILINE))
    assert article.count("<table>") == len(re.findall(r"^\|(?: *:?-+:? *\|)+$", text, re.MULTILINE))
    assert article.count("<ol>") == len(re.findall(r"^ *1\. ", text, re.MULTILINE))
    assert hooks.deeper_lists("So:\n- a\n  - b\n\n    c\n1. d\n   e\n2. f\n\n   ```sh\n   - g\n   ```\n") == (
        "So:\n\n- a\n    - b\n\n        c\n\n1. d\n    e\n2. f\n\n    ```sh\n    - g\n    ```\n"
    )


def test_pictures_of_the_handout_come_along(site):
    names = {path.name for path in (ROOT / "solutions" / "cloth" / "pictures").iterdir()}
    assert {path.name for path in (site / "handouts" / "cloth" / "pictures").iterdir()} == names


@pytest.mark.parametrize("formula", [r"\begin{bmatrix", r"\left( x", r"\unheard{of}", "a $ b"])
def test_a_formula_that_cannot_be_converted_stops_the_build(hooks, formula):
    from muslin.base.errors import MuslinError

    with pytest.raises(MuslinError, match="formula"):
        hooks.mathml(formula)


def test_formulas_are_found_where_github_finds_them(hooks):
    import markdown

    convert = functools.partial(markdown.markdown, extensions=[hooks.Maths()])
    assert convert("the force $f_i$, and $a$-axis").count("<math") == 2
    for text in ("from 5$ to 6$", "`$x$`", r"\$x\$", "a $ b $ c"):
        assert "<math" not in convert(text)


def test_links_into_the_repository_stay_readable(hooks):
    convert = functools.partial(hooks.inside_the_site, page="grading.md")
    assert convert("[handout](../assignments/cloth/README.md#phi)") == (
        "[handout](handouts/cloth/index.md#phi)"
    )
    assert convert("[the framework](../framework/README.md)") == "the framework (`framework/README.md`)"
    assert convert("[`pyproject.toml`](../pyproject.toml)") == "`pyproject.toml`"
    for kept in (
        "[a](index.md)",
        "[a](https://x.org/b)",
        "[a](../nowhere.md)",
        "```\n[a](../README.md)\n```",
    ):
        assert convert(kept) == kept


def test_every_public_name_is_in_the_reference(site):
    import muslin

    page = (site / "reference" / "index.html").read_text(encoding="utf-8")
    for name in muslin.__all__:
        assert re.search(rf'id="muslin\.[\w.]+\.{name}"', page), name


def test_no_page_loads_anything_from_elsewhere(site):
    loads = re.compile(
        r"""<(?:script|img|iframe|link|source|video)\b[^>]*?\b(?:src|href)=["']?(https?:)?//"""
    )
    for page in site.rglob("*.html"):
        assert not loads.search(page.read_text(encoding="utf-8")), page
    for sheet in site.rglob("*.css"):
        assert not re.search(r"url\(['\"]?(https?:)?//", sheet.read_text(encoding="utf-8")), sheet


# In a real browser -----------------------------------------------------------------------------------------

#: Run in the page when it has loaded: are formulas and pictures there, and did anything come from elsewhere?
PROBE = """
addEventListener("load", () => setTimeout(() => {
  const all = selector => [...document.querySelectorAll(selector)];
  const size = element => element.getBoundingClientRect();
  const formulas = all("math");
  document.documentElement.setAttribute("data-probe", JSON.stringify({
    formulas: formulas.length,
    flat: formulas.filter(f => !(size(f).width > 2 && size(f).height > 5)).length,
    pictures: all("article img").length,
    broken: all("img").filter(i => !i.naturalWidth).map(i => i.src),
    elsewhere: performance.getEntriesByType("resource").map(e => e.name)
      .filter(name => !/^(data|blob|file):/.test(name) && new URL(name).host !== location.host),
    wide: document.documentElement.scrollWidth > innerWidth,
    found: all(".md-search-result__item").length,
    font: getComputedStyle(document.body).fontFamily,
  }));
}, SOON));
"""


@pytest.fixture(scope="module")
def address(site):
    """Address of a server of the site that puts the probe into its pages; what it could not serve."""
    missing = []

    class Handler(http.server.SimpleHTTPRequestHandler):
        def do_GET(self):
            path, _, query = self.path.partition("?")
            body = b""
            if path.endswith(".html"):
                probe = PROBE.replace("SOON", "1500" if not query else "0")
                seconds = query.rpartition("wait=")[2]
                wait = f'<script async src="/slow.js?{seconds}"></script>' if seconds else ""
                page = (site / path.lstrip("/")).read_text(encoding="utf-8")
                body = page.replace("<head>", f"<head><script>{probe}</script>{wait}", 1).encode()
            elif path == "/slow.js":  # a page that waits for it loads so long
                time.sleep(int(query))
            else:
                return super().do_GET()
            self.send_response(200)
            self.send_header("Content-Type", "text/html" if body else "text/javascript")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def send_error(self, *arguments):
            missing.append(self.path)
            super().send_error(*arguments)

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(
        ("127.0.0.1", 0), functools.partial(Handler, directory=str(site))
    )
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}", missing
    server.shutdown()
    server.server_close()


def opened(url: str, tmp_path, width: int = 1200, patience: int = 6000) -> tuple[dict, list[str]]:
    """What the probe saw, and what the console says; no name but this machine's can be resolved."""
    done = subprocess.run(
        [
            BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
            "--disable-background-networking", "--disable-component-update", "--disable-extensions",
            "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", "--enable-logging=stderr",
            f"--window-size={width},900", f"--user-data-dir={tmp_path / 'profile'}",
            *([f"--virtual-time-budget={patience}"] if patience else []), "--dump-dom", url,
        ],
        capture_output=True, text=True, encoding="utf-8", errors="replace", timeout=120, check=False,
    )  # fmt: skip
    assert done.stdout, done.stderr
    probe = re.search(r'data-probe="([^"]*)"', done.stdout)
    said = json.loads(html.unescape(probe[1])) if probe else {}
    return said, [line for line in done.stderr.splitlines() if "CONSOLE" in line]


@in_a_browser
@pytest.mark.parametrize("page", PAGES)
def test_a_page_opens_without_an_error_and_asks_nobody(page, address, tmp_path):
    home, missing = address
    said, console = opened(f"{home}/{page}", tmp_path)
    assert console == []
    assert missing == []
    assert said["elsewhere"] == []
    assert said["broken"] == []
    assert said["flat"] == 0
    assert not said["wide"]
    if "handouts" in page:
        assert said["formulas"] > 400
        assert said["pictures"] > 8
    if page == "index.html":
        assert said["pictures"] == 1
    if page == "gallery.html":
        assert said["pictures"] == 6


@in_a_browser
def test_the_site_opens_from_a_disk_too(site, tmp_path):
    _, console = opened((site / "handouts/cloth/index.html").as_uri(), tmp_path)
    assert console == []


@in_a_browser
@pytest.mark.parametrize("page", ["index.html", "handouts/cloth/index.html"])
def test_the_search_works_from_a_disk_where_browsers_start_no_worker(page, site, tmp_path):
    """In a page at the top and in one below, since each finds the index by its own way."""
    probed = (site / page).with_name("probed.html")
    script = f"<script>{PROBE.replace('SOON', '4000')}</script>"
    text = (site / page).read_text(encoding="utf-8").replace("<head>", f"<head>{script}", 1)
    probed.write_text(text, encoding="utf-8")
    try:
        said, console = opened(f"{probed.as_uri()}?q=right_cauchy_green", tmp_path, patience=8000)
        nothing, _ = opened(f"{probed.as_uri()}?q=zzqqxx", tmp_path, patience=8000)
    finally:
        probed.unlink()
    assert said["found"] > 0
    assert nothing["found"] == 0
    assert said["elsewhere"] == []
    assert console == []


@in_a_browser
def test_a_telephone_shows_the_handout_without_scrolling_sideways(address, tmp_path):
    said, _ = opened(f"{address[0]}/handouts/cloth/index.html", tmp_path, width=500)
    assert not said["wide"]


@in_a_browser
def test_the_search_finds_a_function(site, address, tmp_path):
    index = json.loads((site / "search" / "search_index.json").read_text(encoding="utf-8"))
    assert any(entry["location"].endswith("cloth/index.html#right_cauchy_green") for entry in index["docs"])
    for seconds in (3, 12):  # the search works in a thread of its own, on a busy machine not at once
        url = f"{address[0]}/index.html?q=right_cauchy_green&wait={seconds}"
        said, console = opened(url, tmp_path, patience=0)
        if said["found"]:
            break
    assert said["found"] > 0
    assert console == []


@in_a_browser
def test_the_test_sees_what_it_looks_for(site, address, tmp_path):
    page = (site / "index.html").read_text(encoding="utf-8")
    planted = '<img src="http://pictures.example.org/a.png"><math></math><link rel="stylesheet" href="/nowhere.css">'
    planted += '<script>console.error("oh")</script>'
    (site / "planted.html").write_text(
        page.replace("</article>", f"{planted}</article>", 1), encoding="utf-8"
    )
    said, console = opened(f"{address[0]}/planted.html", tmp_path)
    (site / "planted.html").unlink()
    assert said["elsewhere"] == said["broken"] == ["http://pictures.example.org/a.png"]
    assert said["flat"] == 1
    assert any("oh" in line for line in console)
    assert address[1] == ["/nowhere.css"]
    address[1].clear()
