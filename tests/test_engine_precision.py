"""Single precision, and other places to run: the same cloth, to the digits there are."""

import json
import subprocess
import sys

import numpy as np
import pytest

import muslin
from muslin.base import paths, runtime
from muslin.base.errors import MuslinError

#: What is computed in a process of its own, since the numbers cannot change once kernels have run.
MEASURE = """
import json, sys
import numpy as np
import muslin
from muslin.base import runtime

arch, precision, folder, out = sys.argv[1:]
notice = runtime.choose(arch, precision)
functions = muslin.load(folder) if folder else None
mesh = muslin.mesh.grid(9, 9)
cloth = muslin.Cloth(mesh, mu=1e3, lam=1e3, functions=functions)
x = np.load(out + ".x.npy")
run = muslin.simulate("throw", functions=functions, steps=20)
found = {"force": cloth.gradient(x), "hessian": cloth.hessian(x).toarray(), "x": run.x, "elastic": run.energies.elastic}
np.savez(out, energy=cloth.energy(x), X=cloth.X, **found)
print(json.dumps(notice))
"""


def measured(arch, precision, folder, out):
    """Forces, Hessian and a short simulation, computed there; and what was said."""
    mesh = muslin.mesh.grid(9, 9)
    wave = 0.05 * np.sin(9 * mesh.vertices[:, :1]) * [[0.3, 0.2, 1.0]]
    np.save(f"{out}.x.npy", mesh.vertices * [1.1, 0.95, 1.0] + wave)
    done = subprocess.run(
        [sys.executable, "-c", MEASURE, arch, precision, folder, str(out)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    with np.load(f"{out}.npz") as data:
        return dict(data), json.loads(done.stdout.splitlines()[-1])


def off(found, expected):
    """Largest difference, relative to the largest number."""
    return float(np.abs(found - expected).max() / np.abs(expected).max())


#: A solid's three steps by Newton's method, and what a stiff sheet's say, in single precision.
NEWTON = """
import sys
import numpy as np
import muslin
from muslin.base import runtime
from muslin.base.errors import MuslinError

runtime.choose("cpu", sys.argv[1])
np.save(sys.argv[2], muslin.simulate("beam", steps=3).x)
if sys.argv[1] == "f32":
    try:
        muslin.simulate("hang", resolution=16, integrator="backward-euler", steps=30)
    except MuslinError as error:
        print(error)
"""


def test_newtons_method_ends_in_single_precision_or_says_what_to_do(tmp_path):
    said = [
        subprocess.run(
            [sys.executable, "-c", NEWTON, precision, str(tmp_path / f"{precision}.npy")],
            capture_output=True, text=True, check=True,
        ).stdout
        for precision in ("f64", "f32")
    ]  # fmt: skip
    double, single = (np.load(tmp_path / f"{precision}.npy") for precision in ("f64", "f32"))
    start = muslin.simulate("beam", steps=0).x
    assert 1e-11 < off(single - start, double - start) < 0.02
    assert "leave --precision out" in " ".join(said[1].split())


@pytest.mark.parametrize("folder", ["", str(paths.solution("cloth"))], ids=["native", "student"])
def test_single_precision_is_right_to_its_digits(folder, tmp_path):
    double, _ = measured("cpu", "f64", folder, tmp_path / "f64")
    single, said = measured("cpu", "f32", folder, tmp_path / "f32")
    assert said == ""
    for what, most in {"energy": 1e-5, "force": 1e-5, "hessian": 1e-5, "elastic": 1e-3, "x": 1e-5}.items():
        error = off(single[what], double[what])
        assert 1e-11 < error < most, (what, error)
    np.testing.assert_array_equal(single["X"], double["X"], "what is only read keeps its digits")


AWAY = """
import json, sys
import numpy as np
import muslin
from muslin.base import runtime

runtime.choose("cpu", "f32")
functions = muslin.load(sys.argv[1]) if sys.argv[1] else None
found = {}
for away in (0.0, 1.0, 30.0):
    mesh = muslin.mesh.grid(33, 33)
    mesh = muslin.mesh.Mesh.from_arrays(mesh.vertices + away * np.array([0.6, -0.7, 0.4]), mesh.triangles)
    bending = dict(bending="shells", bending_stiffness=1e-5)
    cloth = muslin.Cloth(mesh, mu=2e3, lam=2e3, rho=0.2, functions=functions, **bending)
    weight = 9.81 * cloth.mass.sum() / 3 / len(cloth.X)
    found[away] = float(np.abs(cloth.gradient(cloth.X)).max() / weight)
print(json.dumps(list(found.values())))
"""


@pytest.mark.parametrize("folder", ["", str(paths.solution("cloth"))], ids=["native", "student"])
def test_a_cloth_at_rest_anywhere_feels_next_to_nothing_in_single_precision(folder):
    done = subprocess.run([sys.executable, "-c", AWAY, folder], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    here, near, far = json.loads(done.stdout.splitlines()[-1])
    assert max(here, near, far) < 0.1, (here, near, far)  # of its weight, at the vertex where it is most


@pytest.mark.parametrize("arch", ["vulkan", "cuda", "metal"])
def test_other_architectures_agree_or_the_cpu_stands_in_with_a_notice(arch, tmp_path):
    here, _ = measured("cpu", "f32", "", tmp_path / "cpu")
    there, said = measured(arch, "f32", "", tmp_path / arch)
    if said:
        assert said.endswith("here: running on the CPU.")
        np.testing.assert_array_equal(there["x"], here["x"])
    for what in ("energy", "force", "hessian"):
        assert off(there[what], here[what]) < 1e-5, what
    assert off(there["x"], here["x"]) < 1e-4


def test_conjugate_gradients_end_in_single_precision_too(tmp_path):
    command = [sys.executable, "-m", "muslin.cli", "simulate", "throw", "--steps", "3", "--set", "solver=cg"]
    for precision in runtime.PRECISIONS:
        more = ["--precision", precision, "--out", precision]
        done = subprocess.run([*command, *more], capture_output=True, text=True, cwd=tmp_path, check=False)
        assert done.returncode == 0, done.stderr
    single, double = (np.load(tmp_path / p / "frames" / "000003.npy") for p in ("f32", "f64"))
    assert off(single, double) < 1e-5


def test_nonsense_and_late_choices_are_refused():
    with pytest.raises(MuslinError, match="no architecture 'abacus'"):
        runtime.choose("abacus")
    with pytest.raises(MuslinError, match="no precision 'f16'"):
        runtime.choose("cpu", "f16")
    muslin.simulate("throw", steps=1)
    runtime.choose("cpu", "f64")  # what is chosen already
    with pytest.raises(MuslinError, match="have run already"):
        runtime.choose("cpu", "f32")


def test_the_command_line_says_where_it_ran(tmp_path):
    def simulate(*words):
        command = [
            sys.executable,
            "-m",
            "muslin.cli",
            "simulate",
            "throw",
            "--steps",
            "2",
            "--out",
            "run",
            *words,
        ]
        return subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)

    done = simulate("--precision", "f32")
    assert done.returncode == 0, done.stderr
    single = np.load(tmp_path / "run" / "frames" / "000002.npy")
    assert simulate().returncode == 0
    double = np.load(tmp_path / "run" / "frames" / "000002.npy")
    assert 0 < np.abs(single - double).max() < 1e-6
    wrong = simulate("--arch", "abacus")
    assert wrong.returncode != 0
    assert "There is: cpu, cuda, vulkan, metal" in wrong.stderr
    assert "Traceback" not in wrong.stderr
