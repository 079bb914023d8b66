# SPDX-License-Identifier: MIT
"""The workbench: one log from channels to a checked model, in the browser.

What it does is in plain functions of this folder; `views` shows it and hands over what is typed.
"""
