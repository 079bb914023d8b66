#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Builds the wheel of the last commit once more, in another folder and with an empty cargo target,
# and compares it with WHEEL. ARGUMENTS are those of `maturin build` for WHEEL.
# Usage: tools/reproduce_wheel.sh BIN WHEEL ARGUMENTS...
set -euo pipefail

bin=$1
wheel=$(realpath "$2")
shift 2
if ! git diff --quiet HEAD; then
    printf 'the tree differs from its last commit: commit it, then build the wheel\n' >&2
    exit 1
fi
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT

git clone --quiet . "$place/clone"
(cd "$place/clone" && "$bin/maturin" build "$@" --out "$place")
"$bin/python" -m tools.compare_wheels "$wheel" "$place/${wheel##*/}"
