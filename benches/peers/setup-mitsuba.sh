#!/usr/bin/env bash
# Makes a Python environment with Mitsuba 3, against which `cargo bench --bench time_to_error -- --peer mitsuba` compares.
#
#   benches/peers/setup-mitsuba.sh [FOLDER]       the folder of the environment, target/mitsuba by default
#
# Mitsuba's LLVM variants need libLLVM, best version 19 or later. Where the system's is older or missing, let DRJIT_LIBLLVM_PATH name the
# library, for instance DRJIT_LIBLLVM_PATH=/usr/lib/llvm-19/lib/libLLVM.so.19.1.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

folder="${1:-target/mitsuba}"
if [ "$folder" = -h ] || [ "$folder" = --help ]; then
    sed -n '2,/^$/s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"
    exit 0
fi

# The version that docs/BENCHMARKS.md was written with.
MITSUBA_VERSION=3.9.1

python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check "mitsuba==$MITSUBA_VERSION" numpy

if ! "$folder/bin/python" - <<'PYTHON'; then
import mitsuba

mitsuba.set_variant("llvm_ad_rgb")
scene = mitsuba.load_dict(mitsuba.cornell_box())
print("Mitsuba", mitsuba.__version__, "renders; mean", mitsuba.render(scene, spp=1).numpy().mean())
PYTHON
    echo "Mitsuba is installed in $folder but its LLVM variant does not run: set DRJIT_LIBLLVM_PATH (see this script's head)." >&2
    exit 1
fi
echo "cargo bench --bench time_to_error -- --peer mitsuba --python $folder/bin/python"
