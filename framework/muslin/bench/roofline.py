"""What this machine does at best: how fast it moves bytes and multiplies matrices."""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np

from muslin.base import runtime

#: Size of the arrays copied, far beyond any cache [bytes].
COPIED = 128 << 20

_MATMUL = """
import time, numpy as np
a, b, out = np.random.rand(768, 768), np.random.rand(768, 768), np.empty((768, 768))
best = 1e9
for _ in range({times}):
    begin = time.perf_counter(); np.matmul(a, b, out=out); best = min(best, time.perf_counter() - begin)
print(2 * 768**3 / best)
"""


def bandwidth(threads: int = 1, times: int = 5) -> float:
    """Bytes read and written per second by copying arrays, the best of some times."""
    share = COPIED // threads // 8
    pairs = [(np.ones(share), np.ones(share)) for _ in range(threads)]
    best = np.inf
    for _ in range(times):
        workers = [threading.Thread(target=np.copyto, args=pair) for pair in pairs]
        begin = time.perf_counter()
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        best = min(best, time.perf_counter() - begin)
    return 2 * 8 * share * threads / best


def peak(times: int = 20) -> float:
    """Double-precision flops per second of NumPy's matrix product on one thread, the best of some times."""
    one = {name: "1" for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")}
    done = subprocess.run(
        [sys.executable, "-c", _MATMUL.format(times=times)], capture_output=True, text=True, check=True,
        env=os.environ | one,
    )  # fmt: skip
    return float(done.stdout)


def yardstick(times: int = 3) -> float:
    """CPU time of a fixed piece of work on one thread [ms]: what times are compared with where nothing else does it.

    Work of the interpreter, one object at a time, as most of a check is: of arrays NumPy sorts, some processors
    make a third of the time of others.
    """
    numbers = np.random.default_rng(0).random(30_000).tolist()
    best = np.inf
    for _ in range(times):
        begin = time.thread_time()
        written = [f"{number:.6f}" for number in sorted(numbers)]
        {text: len(text) for text in written}
        best = min(best, time.thread_time() - begin)
    return 1e3 * best


def kind() -> str:
    """The kind of processor: cores that can be used, its model, and the widest vectors a compiler may fill."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").partition("\n\n")[0].splitlines()
    except OSError:
        lines = []
    said = dict(re.split(r"\s*:\s*", line, maxsplit=1) for line in lines if ":" in line)
    flags = (said.get("flags") or said.get("Features") or "").split()
    names = {"avx512f": "AVX-512", "avx2": "AVX2", "asimd": "NEON"}
    vectors = next((name for flag, name in names.items() if flag in flags), platform.machine())
    model = f"{said.get('cpu family', '')}-{said.get('model', '')}".strip("-")
    cores = runtime.usable_cores()
    parts = (f"{cores} core{'s' * (cores > 1)}", f"{said.get('vendor_id', '')} {model}".strip(), vectors)
    return ", ".join(part for part in parts if part)
