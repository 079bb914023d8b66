# SPDX-License-Identifier: MIT
"""Requests of all commands: arguments with help, examples, and the function that runs each."""
