"""Milliseconds per frame of Muslin and of published packages, on the same cloth, alternating in one run.

    python tests/benchmarks/peers.py [--sizes 32,64,100] [--peers mujoco,style3d,vbd,simkit] [--frames 60]
                                     [--rounds 6] [--environments FOLDER] [--ours muslin,implicit] [--no-sphere]
                                     [--self-contact]

The scene: n x n vertices, 1 m square, 0.2 kg/m^2, horizontal at z = 1, one edge pinned, gravity 9.81 along -z, a
sphere of radius 0.25 half-way under its middle, 2D Lame parameters mu = lam = 1e3 N/m, frames of 1/60 s. Ours takes
one linearly implicit step per frame. Every package gets the same triangles and lives in a process and a virtual
environment of its own, made here with pip. All processes stay alive and take turns of a few frames, so a busy machine
is busy for all; ratios are taken within a round. What cannot be installed or run here is said by name.

`muslin` is that, with contacts in the system (`contact=solve`) and no triangle stretched by more than 0.8 % at the
end of a step (`stretch_limit=1.008`); `unlimited` leaves the limit out; `filter` is ours with the lecture's contacts
alone, which filter the velocity after the solve; `implicit` solves the equation of backward Euler to the end in every
frame (slow). With `--self-contact` the cloth of everybody touches itself as well (ours: `self_collision=fast`; Newton's
Style3D always does), and how many pairs of its triangles cross at the end is counted by code of none of them.

Per package: time per frame (median; and by CPU time), the ratio to ours with its spread, the time from starting Python
to the first frame with empty caches (first size only), and the largest stretch after 1 s. How well a frame solves the
equation of backward Euler, M (x+ - x - dt v) + dt^2 (grad V(x+) - f) = 0 in the free vertices, relative to dt^2 |f|, is
said for the fourth frame, before anything touches the sphere, where the package's energy and mass are ours: elsewhere
it is not comparable.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve()
sys.path.insert(0, str(HERE.parents[1]))  # the tests count crossings
DT = 1 / 60
MU = LAM = 1e3
CENTRE, RADIUS = (0.0, 0.0, 0.6), 0.25
ITSELF = False  # whether the cloth touches itself
GAP = 2e-3  # nearer than this it does [m]
DENSITY = 0.2

#: What pip installs for each package, and what of its settings a reader should know.
PACKAGES = {
    "mujoco": (("mujoco-core==4.0.0",), "flex membrane, integrator=discrete"),
    "style3d": (("newton==1.8.0", "warp-lang==1.19.0"), "Newton, its example's 2 substeps x 10 iterations"),
    "vbd": (("newton==1.8.0", "warp-lang==1.19.0"), "Newton, its example's 10 substeps x 10 iterations"),
    "simkit": (("simkit==0.1.8",), "membrane, one Newton step with its line search, SuperLU"),
}

#: Between turns [s]: idle threads of some BLAS keep a core busy for a tenth of a second.
PAUSE = 0.3

#: Whose energy and mass matrix are ours, so that the residual of our equation says something of them.
COMPARABLE = ("muslin", "unlimited", "filter", "implicit")


def scene(size: int, *centre: float):
    """Our scene."""
    sys.path.insert(0, str(HERE.parent))
    from dataclasses import replace

    from steps import scene_of

    return replace(scene_of("neutral", size, 1), sphere_center=centre)


# The packages: each a generator of positions, one frame at a time, run in its own environment ------------------------


def frames_of_muslin(
    X, triangles, pinned, integrator="linearly-implicit", contact="solve", stretch_limit=1.008
):
    """Our own element and the fast solver, contacts in the system, and the stretch limited."""
    from dataclasses import replace

    from muslin.simulation import integrators
    from muslin.simulation import simulating as simulation

    itself = {"self_collision": "fast", "self_gap": GAP} if ITSELF else {}
    model, state = simulation.build(
        replace(scene(round(len(X) ** 0.5), *CENTRE), contact=contact, stretch_limit=stretch_limit, **itself)
    )
    assert (model.body.cells == triangles).all()
    states = integrators.steps(model, state, DT, integrator)
    next(states)
    for state in states:
        yield state.x


def frames_of_unlimited(X, triangles, pinned):
    """Ours, with contacts in the system, however far triangles are stretched."""
    yield from frames_of_muslin(X, triangles, pinned, stretch_limit=0.0)


def frames_of_filter(X, triangles, pinned):
    """Ours, with the lecture's contacts: a filter after the solve."""
    yield from frames_of_muslin(X, triangles, pinned, contact="filter", stretch_limit=0.0)


def frames_of_implicit(X, triangles, pinned):
    """Ours, with the lecture's contacts, and the equation of backward Euler solved to the end by Newton's method."""
    yield from frames_of_muslin(X, triangles, pinned, "backward-euler", "filter", 0.0)


def frames_of_mujoco(X, triangles, pinned):
    """A flex of dimension 2: Young's modulus and Poisson's ratio of the plane-stress membrane with our mu and lam."""
    import mujoco

    thickness, nu = 1e-2, LAM / (LAM + 2 * MU)
    young = 4 * MU * (LAM + MU) / (LAM + 2 * MU) / thickness

    def text(numbers):
        return " ".join(f"{x:.17g}" for x in np.ravel(numbers))

    xml = f"""<mujoco><option timestep="{DT!r}" integrator="discrete" gravity="0 0 -9.81"/>
    <size memory="2G"/><worldbody>
    <geom type="sphere" size="{RADIUS}" pos="{text(CENTRE)}" condim="1"/>
    <flexcomp name="cloth" type="direct" dim="2" mass="{DENSITY}" radius="{GAP / 2}" point="{text(X)}"
      element="{text(triangles)}"><pin id="{text(pinned)}"/>
      <elasticity young="{young:.17g}" poisson="{nu:.17g}" thickness="{thickness}" elastic2d="stretch"/>
      <contact selfcollide="{"auto" if ITSELF else "none"}" condim="1"/></flexcomp></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)

    def positions():
        mujoco.mj_kinematics(model, data)
        mujoco.mj_flex(model, data)
        return data.flexvert_xpos

    while True:
        mujoco.mj_step(model, data)
        yield positions  # MuJoCo itself updates them in the next step


def frames_of_newton(X, triangles, pinned, solver, substeps, iterations=10):
    """Newton on the CPU, single precision."""
    import newton
    import warp as wp

    wp.config.quiet = True
    a, b, c = (X[triangles[0, k]] for k in range(3))
    if np.cross(b - a, c - a)[2] < 0:  # Style3D drops triangles that are wound the other way round
        triangles = triangles[:, ::-1]
    builder = newton.ModelBuilder()
    common = {
        "pos": wp.vec3(0.0), "rot": wp.quat_identity(), "vel": wp.vec3(0.0), "scale": 1.0, "density": DENSITY,
        "vertices": [wp.vec3(*map(float, x)) for x in X], "indices": triangles.ravel().tolist(),
        "particle_radius": 1e-3,
    }  # fmt: skip
    if solver == "style3d":
        newton.solvers.SolverStyle3D.register_custom_attributes(builder)
        stretch = wp.vec3(2 * MU + LAM, 2 * MU + LAM, MU)
        newton.solvers.style3d.add_cloth_mesh(
            builder, **common, tri_aniso_ke=stretch, edge_aniso_ke=wp.vec3(0.0)
        )
    else:
        builder.add_cloth_mesh(**common, tri_ke=MU, tri_ka=LAM, tri_kd=0.0, edge_ke=0.0, edge_kd=0.0)
    for i in pinned:
        builder.particle_mass[i] = 0.0
        builder.particle_flags[i] = int(builder.particle_flags[i]) & ~int(newton.ParticleFlags.ACTIVE)
    builder.add_shape_sphere(-1, xform=wp.transform(wp.vec3(*CENTRE), wp.quat_identity()), radius=RADIUS)
    if solver == "vbd":
        builder.color(include_bending=False)
    model = builder.finalize(device="cpu")
    model.soft_contact_mu = 0.0
    if solver == "style3d":
        config = newton.solvers.SolverStyle3D.Config(iterations=iterations)
        stepper = newton.solvers.SolverStyle3D(model, config=config)
    else:
        itself = {
            "particle_enable_self_contact": True, "particle_self_contact_margin": GAP,
            "particle_self_contact_gap": 0.75 * GAP,
        } if ITSELF else {}  # fmt: skip
        stepper = newton.solvers.SolverVBD(model, iterations=iterations, **itself)
    now, following, control = model.state(), model.state(), model.control()
    pipeline = newton.CollisionPipeline(model)
    contacts = pipeline.contacts()
    while True:
        for _ in range(substeps):
            now.clear_forces()
            pipeline.collide(now, contacts)
            stepper.step(now, following, control, contacts, DT / substeps)
            now, following = following, now
        yield now.particle_q.numpy()


def frames_of_style3d(X, triangles, pinned):
    """Projective dynamics."""
    yield from frames_of_newton(X, triangles, pinned, "style3d", 2)


def frames_of_vbd(X, triangles, pinned):
    """Vertex block descent."""
    yield from frames_of_newton(X, triangles, pinned, "vbd", 10)


def frames_of_simkit(X, triangles, pinned):
    """One Newton step of backward Euler for the neo-Hookean membrane; the sphere is a spring."""
    import scipy.sparse as sp
    from simkit.energies import contact_springs_sphere as sphere
    from simkit.energies import membrane_neo_hookean as membrane
    from simkit.massmatrix import massmatrix
    from simkit.membrane_deformation_jacobian import membrane_deformation_jacobian
    from simkit.solvers.newton import newton_solver
    from simkit.volume import volume

    m, stiffness, centre = len(triangles), 1e3, np.array([CENTRE])
    J = membrane_deformation_jacobian(X, triangles).tocsr()
    mu, lam, area = np.full((m, 1), MU), np.full((m, 1), LAM), volume(X, triangles)
    M = sp.kron(massmatrix(X, triangles, DENSITY), sp.identity(3)).tocsr()
    free = np.setdiff1d(np.arange(X.size), (3 * np.asarray(pinned)[:, None] + np.arange(3)).ravel())
    S = sp.identity(X.size, format="csr")[free]
    x, v = X.reshape(-1, 1).copy(), np.zeros((X.size, 1))
    fall = np.tile([[0.0], [0.0], [-9.81]], (len(X), 1))
    held = x.copy()

    def whole(z):
        held[free] = z
        return held

    while True:
        goal = x + DT * v + DT**2 * fall

        def gradient(z, goal=goal):
            y = whole(z)
            inner = membrane.membrane_neo_hookean_gradient_x(y.reshape(-1, 3), J, mu, lam, area)
            outer = sphere.contact_springs_sphere_gradient(y.reshape(-1, 3), stiffness, centre, RADIUS)
            return S @ (M @ (y - goal) / DT**2 + inner.reshape(-1, 1) + outer)

        def hessian(z):
            y = whole(z).reshape(-1, 3)
            inner = membrane.membrane_neo_hookean_hessian_x(y, J, mu, lam, area)
            outer = sphere.contact_springs_sphere_hessian(y, stiffness, centre, RADIUS)
            return S @ (M / DT**2 + inner + outer) @ S.T

        def energy(z, goal=goal):
            y = whole(z)
            inner = membrane.membrane_neo_hookean_energy_x(y.reshape(-1, 3), J, mu, lam, area)
            outer = sphere.contact_springs_sphere_energy(y.reshape(-1, 3), stiffness, centre, RADIUS)
            inertia = float(((y - goal) * (M @ (y - goal))).sum()) / (2 * DT**2)
            return inertia + float(np.sum(inner)) + outer

        z = newton_solver(x[free].copy(), energy, gradient, hessian)
        following = whole(z).copy()
        x, v = following, (following - x) / DT
        yield x.reshape(-1, 3)


def serve(name: str, problem: str) -> None:
    """In a package's process: answer "K" with the times of K frames, "save FILE" with positions in a file."""
    channel = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what a package prints is not an answer
    global CENTRE, ITSELF
    given = np.load(problem)
    CENTRE, ITSELF = tuple(float(x) for x in given["centre"]), bool(given["itself"])
    frames = globals()[f"frames_of_{name}"](given["X"], given["triangles"], given["pinned"])
    x = given["X"]
    for line in sys.stdin:
        word, *rest = line.split()
        if word == "save":
            np.save(rest[0], np.array(x() if callable(x) else x, dtype=float))
            times = []
        else:
            times = []
            for _ in range(int(word)):
                wall, cpu = time.perf_counter(), time.process_time()
                x = next(frames)
                times.append((1e3 * (time.perf_counter() - wall), 1e3 * (time.process_time() - cpu)))
        print(json.dumps(times), file=channel, flush=True)


# The comparison ------------------------------------------------------------------------------------------------------


class Peer:
    """A package's living process."""

    def __init__(self, name: str, python: Path, problem: Path, cache: Path):
        environment = os.environ | {
            "WARP_CACHE_PATH": str(cache), "TI_OFFLINE_CACHE_FILE_PATH": str(cache),
        }  # fmt: skip
        self.log = cache.parent / f"{name}.log"
        begin = time.perf_counter()
        with self.log.open("w") as log:
            self.process = subprocess.Popen(
                [python, HERE, "--serve", name, str(problem)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                stderr=log, text=True, env=environment, cwd=cache.parent,
            )  # fmt: skip
        first = self.ask("1")
        self.cold = time.perf_counter() - begin
        self.times = [first]

    def ask(self, words: str) -> list[tuple[float, float]]:
        """One question, one answer."""
        assert self.process.stdin
        assert self.process.stdout
        try:
            print(words, file=self.process.stdin, flush=True)
            answer = self.process.stdout.readline()
        except BrokenPipeError:
            answer = ""
        if not answer:
            said = self.log.read_text().strip().splitlines() or ["it said nothing"]
            raise RuntimeError(said[-1])
        return json.loads(answer)

    def positions(self, file: Path) -> np.ndarray:
        """Where its vertices are now."""
        self.ask(f"save {file}")
        return np.load(file)

    def close(self) -> None:
        """End it."""
        assert self.process.stdin
        self.process.stdin.close()
        self.process.wait()


def environment(folder: Path, name: str) -> Path:
    """Python of a package's virtual environment, made if it is not there."""
    packages, _ = PACKAGES[name]
    where = folder / packages[0].split("=")[0]
    python = where / "bin" / "python"
    if not (where / "complete").is_file():
        subprocess.run([sys.executable, "-m", "venv", str(where)], check=True, stdout=subprocess.DEVNULL)
        extra = [] if name == "simkit" else ["numpy"]
        command = [python, "-m", "pip", "install", "--quiet", *packages, *extra]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        (where / "complete").touch()
    return python


def residual(model, before: np.ndarray, earlier: np.ndarray, x: np.ndarray) -> float:
    """Of the equation of backward Euler at x, relative to dt^2 |f|, after positions `earlier` and `before`."""
    M, free = model.body.mass, ~model.system.pinned
    inertia = (M @ (x - 2 * before + earlier).ravel()).reshape(-1, 3)
    rest = inertia + DT**2 * (model.body.gradient(x) - model.weight)
    return float(np.linalg.norm(rest[free]) / np.linalg.norm(DT**2 * model.weight[free]))


def compare(
    size: int, pythons: dict[str, Path], options: argparse.Namespace, folder: Path, cold: bool
) -> None:
    """All packages on one size."""
    from test_self_contact import crossings

    from muslin.simulation import simulating as simulation

    centre = (*CENTRE[:2], -100.0) if options.no_sphere else CENTRE
    model, state = simulation.build(scene(size, *centre))
    problem = folder / f"{size}.npz"
    np.savez(
        problem,
        X=state.x,
        triangles=model.body.cells,
        pinned=model.pinned,
        centre=centre,
        itself=options.self_contact,
    )
    print(f"\n{size}x{size} vertices", flush=True)
    peers: dict[str, Peer] = {}
    residuals: dict[str, float] = {}
    for name, python in pythons.items():
        try:
            peer = Peer(name, python, problem, folder / f"cache-{name}")
            positions = [state.x, peer.positions(folder / "x.npy")]
            for _ in range(3):
                peer.times.append(peer.ask("1"))
                positions.append(peer.positions(folder / "x.npy"))
            residuals[name] = residual(model, positions[-2], positions[-3], positions[-1])
            peers[name] = peer
        except RuntimeError as error:
            print(f"  {name} does not run here: {error}", flush=True)
    done, rounds = 4, {name: [] for name in peers}
    turn = max(1, (options.frames - done) // options.rounds)
    while done < options.frames:
        count = min(turn, options.frames - done)
        for name in list(peers):
            time.sleep(PAUSE)
            try:
                taken = peers[name].ask(str(count))
                rounds[name].append(np.median(np.array(taken), axis=0))
            except RuntimeError as error:
                print(f"  {name} fails after frame {done}: {error}", flush=True)
                del peers[name]
        done += count
    base = np.array(rounds["muslin"])
    for name, peer in peers.items():
        taken = np.array(rounds[name])
        x = peer.positions(folder / "x.npy")
        stretch = model.body.stretches(x).max()
        crossed = crossings(x, model.body.cells) if options.self_contact else 0
        (wall, cpu), ratios = np.median(taken, axis=0), taken / base
        low, high = ratios.min(axis=0), ratios.max(axis=0)
        middle = np.median(ratios, axis=0)
        text = f"  {name:8} {wall:8.1f} ms wall, {cpu:8.1f} CPU"
        if name != "muslin":
            text += f"; ours is {middle[0]:6.1f} ({low[0]:.1f}-{high[0]:.1f}) times faster by wall, "
            text += f"{middle[1]:6.1f} ({low[1]:.1f}-{high[1]:.1f}) by CPU"
        text += f"; largest stretch after {options.frames} frames {stretch:.4f}; residual "
        text += f"{residuals[name]:.1e}" if name in COMPARABLE else "not comparable"
        text += f"; {crossed} pairs cross" if options.self_contact else ""
        text += f"; first frame, cold, after {peer.cold:.1f} s" if cold else ""
        print(text, flush=True)
        peer.close()


def main() -> None:
    """Make the environments, then compare size by size."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sizes", default="32,64,100")
    parser.add_argument("--peers", default=",".join(PACKAGES))
    parser.add_argument("--ours", default="muslin", help="muslin,unlimited,filter,implicit")
    parser.add_argument(
        "--no-sphere", action="store_true", help="nothing to touch: a comparison of the elasticity"
    )
    parser.add_argument("--self-contact", action="store_true", help="the cloth touches itself, too")
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--environments", type=Path, help="keep the virtual environments here")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        pythons = {name: Path(sys.executable) for name in options.ours.split(",")}
        for peer in options.peers.split(","):
            try:
                pythons[peer] = environment(options.environments or folder / "environments", peer)
                print(f"{peer}: {', '.join(PACKAGES[peer][0])}; {PACKAGES[peer][1]}", flush=True)
            except (subprocess.CalledProcessError, OSError) as error:
                print(f"{peer} cannot be installed here: {error}", flush=True)
        for k, size in enumerate(map(int, options.sizes.split(","))):
            compare(size, pythons, options, folder, cold=k == 0)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(*sys.argv[2:])
    else:
        main()
