# Shared by the scripts in this folder, which source it. It leaves the shell at the root of the repository.
# shellcheck shell=bash

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# rustup installs here, and a shell that is not a login shell often does not look here. `ldconfig` is in sbin.
PATH="$PATH:${CARGO_HOME:-${HOME:-}/.cargo}/bin:/usr/sbin:/sbin"

# `ci/setup --test` installs the spelling checker here, and `ci/test` runs it from here.
# shellcheck disable=SC2034 # used by the scripts that source this file
TYPOS="$PWD/.cache/typos/bin/typos"

say() { printf '%s\n' "$*"; }

fail() {
    printf '%s: %s\n' "$(basename "$0")" "$*" >&2
    exit 1
}

# Prints the comment at the head of the running script.
usage() { sed -n '2,/^$/s/^# \{0,1\}//p' "ci/$(basename "$0")"; }
