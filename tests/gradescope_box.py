"""Gradescope's container, as near as a mount namespace comes to it: `/autograder`, root without most of its rights.

The box has the host's files, with `/autograder` and `/opt/muslin` of its own. Root in it has the capabilities of
a Docker container and, being in a chroot, may not make user namespaces: as there, grading has the level `uid`.
Nothing is installed: `/opt/muslin` is the pack's own wheel, unpacked, with the running interpreter's packages.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

RIGHTS = (
    "chown,dac_override,fowner,fsetid,kill,setgid,setuid,setpcap,net_bind_service,net_raw,sys_chroot,mknod,"
    "audit_write,setfcap"
)

#: Some user of the block grading takes its users from.
STUDENT = 61234

ENTER = r"""
set -e
root=$1; own=$2; shift 2
mount -t tmpfs none "$root"
for entry in /*; do
  name=${entry#/}
  case $name in autograder | opt) continue ;; esac
  if [ -L "$entry" ]; then cp -P "$entry" "$root/$name"
  elif [ -d "$entry" ]; then mkdir "$root/$name"; mount --rbind "$entry" "$root/$name"
  fi
done
mkdir -p "$root/autograder" "$root/opt"
mount --bind "$own/autograder" "$root/autograder"
mount --bind "$own/opt" "$root/opt"
mkdir -p "$own/autograder/results"
exec chroot "$root" "$@"
"""


def missing() -> str:
    """Why there can be no box here; empty if there can."""
    if not sys.platform.startswith("linux"):
        return "needs Linux"
    if os.geteuid() != 0:
        return "needs root, to be Gradescope's root without its rights"
    if absent := [name for name in ("unshare", "setpriv", "chroot", "mount") if not shutil.which(name)]:
        return f"needs {', '.join(absent)}"
    if subprocess.run(["unshare", "--mount", "true"], capture_output=True).returncode:
        return "this system gives no mount namespaces"
    if python() is None:
        return f"no Python {sys.version_info.major}.{sys.version_info.minor} that other users may read"
    return ""


def readable(path: str) -> bool:
    """Whether the student's user can list a folder."""
    command = ["setpriv", f"--reuid={STUDENT}", f"--regid={STUDENT}", "--clear-groups", "ls", path]
    return subprocess.run(command, capture_output=True).returncode == 0


def python() -> str | None:
    """An interpreter of this version that the student's user may run, with packages it may read."""
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    candidates = [f"{sys.base_prefix}/bin/{version}", f"/usr/bin/{version}", f"/usr/local/bin/{version}"]
    if not readable(sysconfig.get_paths()["platlib"]):
        return None
    for candidate in candidates:
        own = ["setpriv", f"--reuid={STUDENT}", f"--regid={STUDENT}", "--clear-groups"]
        look = f"import os, venv; os.listdir(os.path.dirname(os.__file__)); os.stat({candidate!r})"
        if not os.path.exists(candidate):
            continue
        if subprocess.run([*own, candidate, "-I", "-c", look], capture_output=True).returncode == 0:
            return candidate
    return None


class Box:
    """A box with a pack in it."""

    def __init__(self, folder: Path, archive: Path):
        self.folder, self.root = folder, folder / "root"
        self.autograder = folder / "autograder"
        for name in ("root", "home", "autograder/source", "autograder/results", "opt"):
            (folder / name).mkdir(parents=True, exist_ok=True)
        for place in (folder, self.root, folder / "opt"):
            place.chmod(0o755)
        with zipfile.ZipFile(archive) as pack:
            pack.extractall(self.autograder / "source")
        shutil.copy(self.autograder / "source" / "run_autograder", self.autograder)
        (self.autograder / "run_autograder").chmod(0o755)
        (self.autograder / "submission_metadata.json").write_text('{"users": [{"email": "s@example.com"}]}')
        self._install()

    def _install(self) -> None:
        """What `setup.sh` does, from what is here."""
        target = self.folder / "opt" / "muslin"
        subprocess.run([python(), "-m", "venv", "--without-pip", target], check=True)
        packages = next(target.glob("lib/python*/site-packages"))
        (packages / "borrowed.pth").write_text(sysconfig.get_paths()["purelib"] + "\n")
        with zipfile.ZipFile(next((self.autograder / "source").glob("muslin-*.whl"))) as wheel:
            wheel.extractall(packages)
        subprocess.run(["chmod", "-R", "go+rX", target], check=True)

    def run(self, *command: str, before: tuple[str, ...] = (), **options) -> subprocess.CompletedProcess[str]:
        """Run a command in the box, as its root."""
        environment = {"PATH": os.environ["PATH"], "HOME": str(self.folder / "home"), "LANG": "C.UTF-8"}
        enter = ["unshare", "--mount", "--propagation", "private", "bash", "-c", ENTER, "enter"]
        drop = ["setpriv", f"--bounding-set=-all,+{RIGHTS.replace(',', ',+')}", "--inh-caps=-all"]
        return subprocess.run(
            [*before, *enter, str(self.root), str(self.folder), *drop, *command],
            capture_output=True, text=True, env=environment, **options,
        )  # fmt: skip

    def hand_in(self, source: Path | None) -> None:
        """Put a submission where Gradescope does; None for none at all."""
        place = self.autograder / "submission"
        shutil.rmtree(place, ignore_errors=True)
        if source is not None:
            shutil.copytree(source, place, symlinks=True)

    def grade(self, source: Path | None, before: tuple[str, ...] = ()) -> subprocess.CompletedProcess[str]:
        """Hand in, and run the autograder."""
        self.hand_in(source)
        return self.run("/autograder/run_autograder", before=before, timeout=580, cwd="/")

    @property
    def results(self) -> Path:
        """The result file."""
        return self.autograder / "results" / "results.json"
