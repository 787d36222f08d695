#!/usr/bin/env bash
# Gradescope runs this once, as root, when it builds the image: Python, Muslin and what it needs, in pinned versions.
set -euo pipefail

source=/autograder/source
target=/opt/muslin

PATH=/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin # a Python that every user may run, not one of root's own
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
apt-get install -y -qq --no-install-recommends libx11-6 python3 python3-venv

python=
for candidate in python3.12 python3.11 python3.13 python3.10 python3.14 python3; do
  if "$candidate" -c 'import ensurepip, sys; sys.exit(not (3, 10) <= sys.version_info < (3, 15))' 2>/dev/null; then
    python=$candidate
    break
  fi
done
if [ -z "$python" ]; then
  echo "Muslin needs Python 3.10 to 3.14: choose the base image Ubuntu 22.04 or 24.04." >&2
  exit 1
fi

"$python" -m venv "$target"
"$target/bin/python" -m pip install --quiet --no-cache-dir --only-binary :all: \
  --constraint "$source/constraints.txt" "$source"/muslin-*.whl

# Everyone may read Python and Muslin; only root what came with this pack, hidden data among it.
chmod -R go-w,go+rX "$target"
chmod -R go-rwx "$source"

"$target/bin/python" -I -m muslin.packing.grading try @assignment@
