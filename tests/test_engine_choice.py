"""Taichi, or Quadrants beside it: which one is taken, what is said where none can be, and what students' files see."""

import builtins
import inspect
import itertools
import os
import platform
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
from packaging.requirements import Requirement

import muslin
from muslin.base import engine
from muslin.base.engine import choice, imports, inside
from muslin.base.errors import MuslinError

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parent.parent
INSTALLED = [name for name, known in engine.ENGINES.items() if known.installed]
PYTHONS = [(3, minor) for minor in range(10, 16)]
MACHINES = [
    ("Linux", "x86_64", "linux"),
    ("Linux", "aarch64", "linux"),
    ("Linux", "riscv64", "linux"),
    ("Darwin", "arm64", "darwin"),
    ("Darwin", "x86_64", "darwin"),
    ("Windows", "AMD64", "win32"),
]


def run(code, *, cwd=None, **variables):
    """Python in a process of its own, which no other test has imported anything into."""
    environment = {k: v for k, v in os.environ.items() if k != engine.VARIABLE} | variables
    return subprocess.run(
        [sys.executable, "-c", code], env=environment, cwd=cwd, capture_output=True, text=True, check=False
    )


@pytest.fixture
def machine(monkeypatch):
    """Puts this process on another machine, as far as the choice of an engine can see."""

    def put(system="Linux", processor="x86_64", python=(3, 12), installed=()):
        monkeypatch.setattr(platform, "system", lambda: system)
        monkeypatch.setattr(platform, "machine", lambda: processor)
        monkeypatch.setattr(choice, "sys", SimpleNamespace(version_info=python, modules=sys.modules))
        found = SimpleNamespace(find_spec=lambda name: object() if name in installed else None)
        monkeypatch.setattr(choice.importlib, "util", found)
        monkeypatch.delenv(engine.VARIABLE, raising=False)

    return put


# --- which ---------------------------------------------------------------------------------------------------


def test_the_package_asks_for_the_engine_that_the_machine_can_have(machine):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    asked = [Requirement(text) for text in project["dependencies"]]
    for (system, processor, short), python in itertools.product(MACHINES, PYTHONS[:-1]):
        machine(system, processor, python)
        here = {
            "sys_platform": short,
            "platform_machine": processor,
            "python_version": ".".join(map(str, python)),
        }
        wanted = {r.name: r for r in asked if r.name in engine.ENGINES and r.marker.evaluate(here)}
        best = next((known for known in engine.ENGINES.values() if engine.requirement(known)), None)
        assert list(wanted) == ([best.name] if best else []), (system, processor, python)
        if best:
            assert wanted[best.name].specifier == Requirement(engine.requirement(best)).specifier


def test_taichi_comes_first_where_both_are_installed_and_the_variable_chooses(machine, monkeypatch):
    machine(installed=("taichi", "quadrants"))
    assert engine.chosen().name == "taichi"
    monkeypatch.setenv(engine.VARIABLE, "quadrants")
    assert engine.chosen().name == "quadrants"
    machine(python=(3, 14), installed=("quadrants",))
    assert engine.chosen().name == "quadrants"


def test_an_unknown_engine_is_answered_with_those_that_are_here(machine, monkeypatch):
    machine(installed=("quadrants",))
    monkeypatch.setenv(engine.VARIABLE, "warp")
    with pytest.raises(MuslinError) as told:
        engine.chosen()
    assert "no engine 'warp'" in told.value.message
    assert told.value.hint == "Installed here: quadrants."


@pytest.mark.parametrize(
    ("system", "processor", "python", "advice"),
    [
        ("Linux", "x86_64", (3, 12), "pip install 'taichi>=1.7.4,<1.8'"),
        ("Linux", "x86_64", (3, 14), "pip install 'quadrants>=1.4,<1.5'"),
        ("Linux", "aarch64", (3, 11), "pip install 'quadrants>=1.3.3,<1.4'"),
        ("Darwin", "x86_64", (3, 12), "Neither has a wheel for Python 3.12 on Darwin x86_64"),
        ("Linux", "x86_64", (3, 15), "use Python 3.10-3.14"),
    ],
)
def test_without_any_engine_one_sentence_says_what_to_install_on_this_machine(
    machine, system, processor, python, advice
):
    machine(system, processor, python)
    with pytest.raises(MuslinError) as told:
        engine.chosen()
    assert told.value.message == "Neither Taichi nor Quadrants is installed."
    assert advice in told.value.hint


def test_an_engine_that_is_chosen_and_missing_is_answered_with_pip_or_with_the_other(machine, monkeypatch):
    machine(installed=("taichi",))
    monkeypatch.setenv(engine.VARIABLE, "quadrants")
    with pytest.raises(MuslinError) as told:
        engine.chosen()
    assert "Quadrants is not installed" in told.value.message
    assert told.value.hint == "Run: pip install 'quadrants>=1.4,<1.5'"
    machine(python=(3, 14), installed=("quadrants",))
    monkeypatch.setenv(engine.VARIABLE, "taichi")
    with pytest.raises(MuslinError) as told:
        engine.chosen()
    assert "no wheel for Python 3.14 on Linux x86_64: unset MUSLIN_ENGINE" in told.value.hint


NO_LIBX11 = "raise ImportError('libX11.so.6: cannot open shared object file: No such file or directory')"


@pytest.mark.parametrize(
    ("taichi", "quadrants", "said"),
    [
        (NO_LIBX11, "pass", ["libX11.so.6 is missing", "libx11-6", "set MUSLIN_ENGINE=quadrants"]),
        (NO_LIBX11, "raise ImportError('bad magic')", ["libX11.so.6 is missing", "Quadrants cannot be imported (bad"]),
    ],
)  # fmt: skip
def test_engines_that_are_broken_are_told_one_by_one(tmp_path, taichi, quadrants, said):
    for name, source in (("taichi", taichi), ("quadrants", quadrants)):
        (tmp_path / f"{name}.py").write_text(source)
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path)!r})\nfrom muslin.base.engine import load\n"
        "from muslin.base.errors import MuslinError\ntry:\n    load()\nexcept MuslinError as error:\n    print(error)"
    )
    done = run(code)
    assert done.stderr == ""
    for words in said:
        assert words in done.stdout


@pytest.mark.parametrize("name", INSTALLED)
def test_an_engine_says_nothing_when_it_starts_not_even_in_a_notebook(name, tmp_path):
    code = (
        "import io, sys\nsys.stdout = kept = io.StringIO()\nfrom muslin.base import runtime\nruntime.start()\n"
        "sys.stderr.write(kept.getvalue())"
    )
    fresh = {"PYTHONPYCACHEPREFIX": str(tmp_path), "PYTHONWARNINGS": "default:invalid escape sequence"}
    done = run(code, **{engine.VARIABLE: name}, **fresh)  # as after an installation that compiles nothing
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


# --- students' files -----------------------------------------------------------------------------------------


@pytest.fixture
def other(monkeypatch):
    """A module that students' files know as `taichi`."""
    stands_in, deep = ModuleType("stands_in"), ModuleType("stands_in.math")
    stands_in.math, stands_in.sqrt, deep.pi = deep, "a root", 3.14
    return stands_in


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("import taichi as ti\nfound = ti.sqrt", "a root"),
        ("import taichi\nfound = taichi.sqrt", "a root"),
        ("from taichi import sqrt as found", "a root"),
        ("import taichi.math as tm\nfound = tm.pi", 3.14),
        ("import taichi.math\nfound = taichi.math.pi", 3.14),
        ("from taichi.math import pi as found", 3.14),
        ("def inside():\n    import taichi as ti\n    return ti.sqrt\nfound = inside()", "a root"),
        ("import os.path as found\nfound = found.sep", os.sep),
    ],
)
def test_a_students_file_finds_the_engine_however_it_imports_it(other, text, found):
    before = sys.modules.get("taichi")
    scope = {"__builtins__": imports.builtins_with({"taichi": other})}
    exec(text, scope)
    assert scope["found"] == found
    assert sys.modules.get("taichi") is before


@pytest.mark.parametrize(
    "text", ["import taichi.no_such", "from taichi import no_such", "from taichi.no_such import x"]
)
def test_what_the_engine_lacks_cannot_be_imported(other, text):
    with pytest.raises(ImportError, match="no_such"):
        exec(text, {"__builtins__": imports.builtins_with({"taichi": other})})


@pytest.mark.skipif("quadrants" not in INSTALLED, reason="Quadrants is not installed")
def test_nothing_outside_a_students_file_sees_quadrants_as_taichi():
    code = (
        "import sys, muslin, numpy as np\n"
        f"f = muslin.load({str(ROOT / 'solutions' / 'cloth')!r})\n"
        "muslin.evaluate(f.right_cauchy_green, F=np.eye(3)[None])\n"
        "assert 'taichi' not in sys.modules, sys.modules['taichi']\n"
        "assert 'quadrants' in sys.modules"
    )
    done = run(code, **{engine.VARIABLE: "quadrants"})
    assert done.returncode == 0, done.stderr


def test_on_taichi_a_students_file_imports_as_any_other():
    if engine.chosen().name != "taichi":
        pytest.skip("Taichi is not the engine")
    assert imports.builtins_with() is builtins


# --- what is not public --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", INSTALLED)
def test_the_version_we_pin_has_every_part_that_muslin_reaches_into(name):
    done = run("from muslin.base.engine import inside; print(inside.lacking())", **{engine.VARIABLE: name})
    assert done.stdout == "[]\n", done.stdout + done.stderr


@pytest.mark.parametrize("name", INSTALLED)
def test_without_those_parts_a_simulation_is_the_same(name):
    steps = (
        "run = muslin.simulate('throw', steps=3, functions=muslin.load({folder!r}))\nprint(run.x.sum(), run.v.sum())"
    ).format(folder=str(ROOT / "solutions" / "cloth"))
    without = "from muslin.base.engine import inside\ninside.has = lambda part: False\n"
    whole, bare = (run(f"import muslin\n{first}{steps}", MUSLIN_ENGINE=name) for first in ("", without))
    assert bare.returncode == 0, bare.stderr
    assert bare.stdout == whole.stdout


def test_quadrants_words_for_a_mistake_become_taichis(monkeypatch):
    monkeypatch.setattr(inside, "load", lambda: SimpleNamespace(__name__="quadrants"))
    trace = "quadrants stack trace:\n===\nTraceback ...\n{}\n===\n\nYour code:\n"
    nested = trace.format("outer") + 'File "a.py", line 2, in f:\n  g(x)\n' + trace.format("inner")
    assert inside.said(nested + "it is 'Quadrants Expression'\n.") == (
        "File \"a.py\", line 2, in f:\n  g(x)\nit is 'Taichi Expression'."
    )
    assert inside.said("/home/quadrants/my quadrants.py, use `qd.sqrt`") == (
        "/home/quadrants/my taichi.py, use `ti.sqrt`"
    )


def test_records_and_runs_name_the_engine_and_its_version(tmp_path):
    run = muslin.simulate("freefall", steps=1, out=tmp_path / "run")
    text = (tmp_path / "run" / "run.json").read_text()
    assert f'"{engine.chosen().name} {engine.version()}"' in text
    assert run is not None


def test_a_frame_is_described_as_the_library_describes_it():
    class Body:
        frame = sys._getframe()

    for frame in (Body.frame, sys._getframe()):
        assert choice.frame_info(frame)[:5] == inspect.getframeinfo(frame)[:5]


def test_a_function_of_a_class_is_still_known_as_one(tmp_path):
    """What the engine looks at frames for."""
    (tmp_path / "own.py").write_text(
        "import inspect\nbefore = inspect.getframeinfo\nfrom muslin.base import runtime\nti = runtime.start()\n"
        "assert inspect.getframeinfo is before\n"
        "class A:\n    @ti.func\n    def f(self): return 1\n"
        "@ti.func\ndef g(): return 1\n"
        "own = lambda f: (getattr(f, 'func', None) or f.wrapper).classfunc\n"  # Quadrants calls it otherwise
        "print(own(A.f), own(g))\n"
    )
    done = run("import own", cwd=tmp_path)
    assert done.stdout.split() == ["True", "False"], done.stderr
