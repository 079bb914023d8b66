#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Checks what has to be on the machine before `make` can build drivetwin: one line for each thing
# that is missing and exit 1, or the path of a fitting Python on standard output.
# Uses shell builtins only, so that it can speak up on a machine that has next to nothing.
set -u

rust_minor=89    # Rust 1.89, as rust-version in Cargo.toml
python_minor=11  # Python 3.11, as requires-python in pyproject.toml
missing=0

lacks() {
    printf 'drivetwin needs %s\n' "$1" >&2
    missing=1
}

# Interpreters are run, not only looked up: version managers leave shims of absent ones on PATH.
find_python() {
    local name
    for name in python3.14 python3.13 python3.12 python3.11 python3; do
        if "$name" -c "import sys; sys.exit(sys.version_info < (3, $python_minor))" \
            >/dev/null 2>&1; then
            python=$("$name" -c 'import sys; print(sys.executable)')
            return 0
        fi
    done
    return 1
}

check_python() {
    if ! find_python; then
        lacks "Python >= 3.$python_minor: none of python3.14 ... python3 on PATH is one"
    elif ! "$python" -c 'import venv, ensurepip' >/dev/null 2>&1; then
        lacks "the venv module of $python (on Debian and Ubuntu: the package python3-venv)"
    fi
}

check_rust() {
    local version minor
    if ! command -v cargo >/dev/null || ! version=$(rustc --version 2>/dev/null); then
        lacks "Rust >= 1.$rust_minor with cargo on PATH (rustup installs both)"
        return
    fi
    version=${version#rustc }
    version=${version%% *}
    minor=${version#*.}
    minor=${minor%%.*}
    if [[ ${version%%.*} -eq 1 && $minor -lt $rust_minor ]]; then
        lacks "Rust >= 1.$rust_minor, found $version (rustup update)"
    fi
}

check_compiler() {
    if ! cc --version >/dev/null 2>&1; then
        lacks "a C compiler that answers to cc, to link (on Debian and Ubuntu: build-essential)"
    fi
}

check_python
check_rust
check_compiler
if [[ $missing -ne 0 ]]; then
    exit 1
fi
printf '%s\n' "$python"
