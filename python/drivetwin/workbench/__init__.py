# SPDX-License-Identifier: MIT
"""The workbench: one log from channels to a checked model, in the browser.

The modules of this folder do the work in plain functions. The package `views` contains the layouts
and passes the user's input to these functions.
"""
