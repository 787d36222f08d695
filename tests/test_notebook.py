"""The notebook: made from the handout, it checks as it is written, and what it finds shows itself."""

import json
import os
import re
import socket
import subprocess
import sys
import time
import urllib.request
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest
from pages import PATIENCE, Tab, in_a_browser

import muslin
from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.reading import source
from muslin.student import submitting, workspace

nbclient = pytest.importorskip("nbclient", reason="pip install muslin[test]")
import nbformat  # noqa: E402

from muslin.notebook import cells, making, shows  # noqa: E402

TABLE = tasks.assignment("cloth")


def solutions():
    """The text of every solved function, by name."""
    folder, found = paths.solution("cloth"), {}
    for file in TABLE.files:
        read = source.Source(source.read(folder / file), file)
        found |= {name: read.piece(function.lines) for name, function in read.functions.items()}
    return found


@pytest.fixture
def started(tmp_path, monkeypatch):
    """A workspace with its notebook, and the working folder in it."""
    folder = tmp_path / "my-cloth"
    workspace.start("cloth", folder)
    making.write("cloth", folder)
    monkeypatch.chdir(folder)
    return folder


def filled(folder, answers, keep=lambda cell: True):
    """The notebook with answers in its cells."""
    book = nbformat.read(folder / "cloth.ipynb", 4)
    for cell in book.cells:
        if (found := re.match(r"%%task (\w+)\n", cell.source)) and found[1] in answers:
            cell.source = f"%%task {found[1]}\n{answers[found[1]]}"
    book.cells = [cell for cell in book.cells if keep(cell)]
    return book


def run(book, folder):
    """The notebook executed in the folder, with a kernel of this Python."""
    client = nbclient.NotebookClient(
        book, timeout=600, kernel_name="python3", resources={"metadata": {"path": folder}}
    )
    client.execute()
    return book


def told(cell):
    """What a cell shows as text."""
    return "\n".join(
        output.get("text") or output.get("data", {}).get("text/plain", "") for output in cell.outputs
    )


def is_task(cell):
    return cell.cell_type == "code" and cell.source.startswith("%%task")


def test_a_notebook_holds_the_whole_handout_and_a_cell_for_each_function():
    book = nbformat.reads(json.dumps(making.notebook("cloth")), 4)
    nbformat.validate(book)
    text = "\n".join(cell.source for cell in book.cells if cell.cell_type == "markdown")
    assert [cell.source.split()[1] for cell in book.cells if is_task(cell)] == list(TABLE.tasks)
    handout = (paths.assignment("cloth") / "README.md").read_text(encoding="utf-8")
    formulas = re.findall(r"```math\n(.*?)```", handout, re.DOTALL)
    assert len(formulas) > 40
    assert all(f"$$\n{formula}$$" in text for formula in formulas)
    assert "```math" not in text
    for name in re.findall(r"\]\(attachment:([^)]+)\)", text):
        assert any(name in cell.get("attachments", {}) for cell in book.cells)
    assert "](pictures/" not in text, "pictures travel with the notebook"


@pytest.mark.parametrize("name", ["cloth", "solids", "none"])
def test_a_notebook_runs_its_own_assignments_scene_or_none(name, monkeypatch):
    """What a cell or the text says to run and to view is what this assignment's functions drive."""
    from muslin.simulation import scenes

    table = tasks.assignment("cloth" if name == "none" else name)
    if name == "none":
        table = replace(table, simulation=None)
        monkeypatch.setattr(making, "assignment", lambda _: table)
        name = "cloth"
    book = "\n".join("".join(cell["source"]) for cell in making.notebook(name)["cells"][1:])
    named = set(re.findall(r"%muslin run ([a-z]+)|view\(\"runs/([a-z]+)\"\)", book))
    scene = table.simulation.scene if table.simulation else None
    assert {a or b for a, b in named} == ({scene} if scene else set())
    assert scene is None or (scenes.get(scene).WORD == "solid") == (name == "solids")
    asked = re.findall(r"%muslin (?:hint|explain|reset) (\w+)", book)
    assert asked
    assert set(asked) <= set(table.tasks)


def test_links_inside_a_notebook_lead_to_headings_of_it():
    book = making.notebook("cloth")
    text = "\n".join("".join(cell["source"]) for cell in book["cells"] if cell["cell_type"] == "markdown")
    headings = {
        making._plain(title).replace(" ", "-") for title in re.findall(r"^#+ +(.+?)$", text, re.MULTILINE)
    }
    links = set(re.findall(r"\]\(#([^)]+)\)", text))
    assert len(links) > 20
    assert links <= headings | {"setting-up"}, links - headings


def test_a_notebook_holds_no_answer():
    text = json.dumps(making.notebook("cloth"))
    for name, piece in solutions().items():
        body = source.Source(piece, name).functions[name]
        lines = [line.strip() for line in piece.splitlines(True)[body.body.start :] if len(line.strip()) > 25]
        for line in lines:
            assert json.dumps(line)[1:-1] not in text, f"{name}: {line}"


def test_the_notebook_goes_from_start_to_all_green_and_hands_in_the_same_zip(started):
    """Executed as a student executes it, with the reference's answers; no film, which has a test of its own."""
    book = run(
        filled(started, solutions(), lambda cell: "drape" not in cell.source or cell.cell_type != "code"),
        started,
    )
    verdicts = [told(cell) for cell in book.cells if is_task(cell)]
    assert len(verdicts) == len(TABLE.tasks) == 17
    assert all("1 of 1 agree with the reference data." in verdict for verdict in verdicts), verdicts
    assert all(cell.outputs[0]["data"]["text/html"] for cell in book.cells if is_task(cell))
    handed = next(
        told(cell) for cell in book.cells if "muslin submit" in cell.source and cell.cell_type == "code"
    )
    assert "17 of 17 tasks" in handed
    assert "Graphical python shell" not in json.dumps(book), "no chatter of the engine"
    from_notebook = (started / "my-cloth-cloth.zip").read_bytes()
    for file in TABLE.files:  # an editor's way to the same work
        text = source.read(paths.solution("cloth") / file)
        given = source.Source(source.read(started / file), file)
        assert source.Source(text, file).functions.keys() == given.functions.keys()
    packed = submitting.pack(workspace.find(started), started / "again.zip")
    assert packed.path.read_bytes() == from_notebook
    with zipfile.ZipFile(packed.path) as archive:
        assert sorted(archive.namelist()) == sorted([*TABLE.files, "assignment.toml"])


def test_three_mistakes_in_a_notebook_are_three_named_verdicts(started):
    answers = solutions()
    wrong = {
        "right_cauchy_green": ("F.transpose() @ F", "F @ F.transpose()"),
        "mass_block": ("12", "6"),
        "filter_velocity": ("d < 0", "d > 0"),
    }
    for name, (right, other) in wrong.items():
        assert right in answers[name], f"the solution of {name} is written in another way now"
        answers[name] = answers[name].replace(right, other)
    book = run(
        filled(
            started,
            {n: answers[n] for n in wrong},
            lambda cell: "load_ext" in cell.source or (is_task(cell) and cell.source.split()[1] in wrong),
        ),
        started,
    )
    for cell in book.cells:
        if is_task(cell):
            html = cell.outputs[0]["data"]["text/html"]
            assert "not yet" in html
            assert ">likely<" in html, html
            assert ">try<" in html


def test_a_cell_that_is_not_a_function_is_refused_in_one_sentence_and_nothing_is_written(started):
    here = workspace.find(started)
    before = (started / "shape_functions.py").read_bytes()
    for text, said in {
        "@ti.func\ndef fi(X, X0, X1, X2):\n    return X\n": "must hold the function phi",
        "@ti.func\ndef phi(X, X0, X1, X2):\n    return (X\n": "line",
        "a = 3\n\n\n@ti.func\ndef phi(X, X0, X1, X2):\n    return X\n": "belongs to no function",
        "": "no function",
    }.items():
        with pytest.raises(MuslinError, match=said):
            cells.written(here, "phi", text)
        assert (started / "shape_functions.py").read_bytes() == before


def test_a_cell_replaces_its_function_and_keeps_the_neighbours(started):
    here, path = workspace.find(started), started / "shape_functions.py"
    helper = "@ti.func\ndef twice(a):\n    return 2.0 * a\n\n\n"
    piece = '@ti.func\ndef dphi_dX(X0, X1, X2):\n    """Mine."""\n    return twice(X0)\n'
    before = source.Source(source.read(path), "before").functions
    for _ in range(2):  # running a cell again changes nothing more
        cells.written(here, "dphi_dX", "import taichi as ti\n\n" + helper + piece)
        after = source.Source(source.read(path), "after")
        assert list(after.functions) == ["phi", "twice", "dphi_dX", "interpolate"]
        assert after.piece(after.functions["dphi_dX"].lines) == piece
    assert before.keys() < after.functions.keys()


def test_a_run_shows_itself_in_a_cell_and_in_one_line_of_text(tmp_path):
    run = muslin.simulate("hang", steps=4, resolution=6, out=tmp_path / "run")
    html = run._repr_html_()
    assert html.count("data:image/png;base64,") == 4, "how it ended, energies, momenta"
    assert "36 vertices" in html
    assert len(repr(run)) < 200
    assert "\n" not in repr(run)
    alone = muslin.simulate("hang", steps=4, resolution=6)
    assert alone._repr_html_().count("data:image/png;base64,") == 4
    drawn = shows.film(run, size=(160, 90))
    assert "data:video/mp4;base64," in drawn._repr_html_()
    with pytest.raises(MuslinError, match="not written to disk"):
        shows.film(alone)


def test_what_a_student_writes_is_text_in_a_verdict_not_html(started):
    here = workspace.find(started)
    report = shows.Report("phi", "wrong", "<script>alert(1)</script>\n<b>", 3, "<img src=x>", "a & b")
    html = shows.Verdicts(here, [report])._repr_html_()
    assert "<script>" not in html
    assert "<img" not in html
    assert "&lt;script&gt;" in html
    assert "%muslin explain phi --case 3" in html


def test_fifty_runs_of_a_task_cell_do_not_fill_the_memory(started):
    answer = solutions()["interpolate"]
    code = [
        f"%%task interpolate\n{answer.replace('return', f'_again = {k}.0{chr(10)}    return')}"
        for k in range(50)
    ]
    memory = (
        "import os\nfrom pathlib import Path\n"
        "pages = int(Path('/proc/self/statm').read_text().split()[1]); print(pages * os.sysconf('SC_PAGE_SIZE'))"
    )
    if not Path("/proc/self/statm").exists():
        pytest.skip("measured on Linux")
    book = nbformat.v4.new_notebook()
    first = ["%load_ext muslin", code[0], memory]
    book.cells = [nbformat.v4.new_code_cell(text) for text in [*first, *code, memory]]
    run(book, started)
    grown = int(told(book.cells[-1])) - int(told(book.cells[2]))
    assert "1 of 1 agree" in told(book.cells[-2])
    assert grown < 100e6, f"{grown / 1e6:.0f} MB"


# In JupyterLab, in a browser ------------------------------------------------------------------------------------


@pytest.fixture
def lab(started):
    """A JupyterLab in the workspace: its address."""
    pytest.importorskip("jupyterlab", reason="JupyterLab is not installed: pip install jupyterlab")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    settings = {
        "ServerApp.token": "", "ServerApp.password": "", "ServerApp.port": port, "ServerApp.ip": "127.0.0.1",
        "ServerApp.open_browser": False, "ServerApp.root_dir": str(started), "ServerApp.allow_root": True,
        "LabApp.expose_app_in_browser": True, "LabApp.extension_manager": "readonly", "LabApp.news_url": "",
    }  # fmt: skip
    command = [sys.executable, "-m", "jupyterlab", *(f"--{key}={value}" for key, value in settings.items())]
    home = {name: str(started / ".jupyter") for name in ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "HOME")}
    server = subprocess.Popen(
        command, env={**os.environ, **home}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    yield f"http://127.0.0.1:{port}"
    server.terminate()
    server.wait(timeout=30)


@in_a_browser
def test_a_verdict_a_film_and_a_view_are_seen_in_jupyterlab(lab, started, tmp_path):
    film = (
        "import muslin\nfrom muslin.notebook import film, view\n\n"
        'run = muslin.simulate("hang", steps=12, resolution=8, out="runs/hang")'
    )
    texts = [
        "%load_ext muslin",
        f"%%task interpolate\n{solutions()['interpolate']}",
        f"{film}\nfilm(run, size=(320, 180))",
        "view(run)",
    ]
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in texts])
    book.metadata["kernelspec"] = {"display_name": "Python 3", "language": "python", "name": "python3"}
    nbformat.write(book, started / "seen.ipynb")
    until = time.monotonic() + PATIENCE
    while True:
        try:
            urllib.request.urlopen(f"{lab}/api/status", timeout=5).close()
            break
        except OSError:
            assert time.monotonic() < until, "JupyterLab did not start"
            time.sleep(0.3)
    tab = Tab(f"{lab}/lab/tree/seen.ipynb?reset", tmp_path / "profile")
    try:

        def value(expression):
            said = tab("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
            return said["result"].get("value")

        def wait(expression):
            until = time.monotonic() + 2 * PATIENCE
            while not value(expression):
                assert time.monotonic() < until, f"never true: {expression}"
                time.sleep(0.5)

        wait("!!(window.jupyterapp && document.querySelector('.jp-Notebook .jp-CodeCell'))")
        wait("jupyterapp.shell.currentWidget.sessionContext?.session?.kernel?.status == 'idle'")
        value("jupyterapp.commands.execute('notebook:run-all-cells').then(() => true)")
        wait("document.body.innerText.includes('1 of 1 agree with the reference data')")
        wait("[...document.querySelectorAll('video')].some(v => v.readyState >= 2 && v.videoWidth == 320)")
        wait("document.querySelectorAll('.jp-OutputArea iframe').length == 1")
        wait(
            "[...document.querySelector('.jp-OutputArea iframe').contentDocument?.querySelectorAll('canvas') ?? []]"
            ".some(c => c.width > 300)"
        )
        errors = [told for told in tab.errors() if "srcdoc" not in told]
        assert not errors, errors
    finally:
        tab.close()
