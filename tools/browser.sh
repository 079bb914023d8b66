#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The path of a Chromium on standard output; on Debian and Ubuntu installed where there is none.
set -euo pipefail

find_browser() {
    local name
    for name in chromium chromium-browser google-chrome; do
        if command -v "$name"; then
            return 0
        fi
    done
    return 1
}

if ! find_browser; then
    as_root=()
    [ "$(id -u)" -eq 0 ] || as_root=(sudo)
    "${as_root[@]}" apt-get update -qq >&2
    "${as_root[@]}" apt-get install -qq --yes --no-install-recommends chromium fonts-liberation >&2
    find_browser
fi
