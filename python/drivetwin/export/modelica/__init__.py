# SPDX-License-Identifier: MIT
"""A driveline as a Modelica model of the Standard Library's rotational components."""
