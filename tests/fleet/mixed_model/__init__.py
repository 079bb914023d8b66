# SPDX-License-Identifier: MIT
"""Tests of joint estimates."""
