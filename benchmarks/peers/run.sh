#!/usr/bin/env bash
# The chain engine beside its peers, in an environment of its own: PEERS_VENV, default .venv-peers.
set -euo pipefail
here="$(cd "$(dirname "$0")" && pwd)"
venv="${PEERS_VENV:-$here/../../.venv-peers}"
results="${PEERS_RESULTS:-$here/../../out/cosseratbench}" # trajectories, some MB: not kept
if [ ! -e "$venv/.peers" ]; then
  python3 -m venv "$venv"
  "$venv/bin/pip" install -q -e "$here/../.." -r "$here/requirements.txt"
  "$venv/bin/pip" install -q -e "$here/cosserat"
  touch "$venv/.peers"
fi
export OMP_NUM_THREADS=1
"$venv/bin/python" "$here/speed.py"
"$venv/bin/python" "$here/workprecision.py"
"$venv/bin/cosseratbench" run cantilever pendulum catenary -s feeler -s pyelastica -o "$results"
"$venv/bin/python" "$here/table.py" "$results"
