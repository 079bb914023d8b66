#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Installs a built wheel in a new environment outside the source tree, with nothing but that
# environment on PATH (no cargo, no compiler), and runs the demo from it.
# Usage: tools/try_wheel.sh PYTHON WHEEL
set -euo pipefail

python=$1
wheel=$(realpath "$2")
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT

run_demo() (
    cd "$place"
    PATH=$place/venv/bin
    for tool in cargo rustc cc; do
        if command -v "$tool"; then
            printf '%s is still on PATH: this run proves nothing\n' "$tool" >&2
            exit 1
        fi
    done
    pip install --quiet --disable-pip-version-check "$wheel"
    drivetwin demo -o "$place/out"
    for file in {likelihood,paper}/{result.json,twin.toml,report.html}; do
        if [[ ! -s $place/out/$file ]]; then
            printf 'the demo wrote no %s\n' "$file" >&2
            exit 1
        fi
    done
)

# Held in a variable: `grep -q` closes a pipe at the first match, and the writer then fails.
contents=$("$python" -m zipfile --list "$wheel")
for list in rust-crates python-packages; do
    if [[ $contents != *"dist-info/sboms/$list.cyclonedx.json"* ]]; then
        printf 'the wheel has no list of parts %s\n' "$list" >&2
        exit 1
    fi
done
"$python" -m venv "$place/venv"
run_demo
printf 'the wheel works without Rust: %s\n' "${wheel##*/}"
