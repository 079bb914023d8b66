# SPDX-License-Identifier: MIT
"""Models that the Standard Library does not have, as text; a package takes those it needs."""

from __future__ import annotations

SLIP_INERTIA = "SlipInertia"
PAPER_GEAR = "ConstantEfficiencyGear"
CONVERTER = "TorqueConverter"

HELPERS = {
    SLIP_INERTIA: """\
  model SlipInertia "Inertia that turns with the relative speed of two flanges"
    extends Modelica.Mechanics.Rotational.Interfaces.PartialCompliantWithRelativeStates;
    parameter Modelica.Units.SI.Inertia J "Inertia";
  equation
    tau = J*a_rel;
  end SlipInertia;
""",
    PAPER_GEAR: """\
  model ConstantEfficiencyGear "Gear with one efficiency in both directions of power"
    extends Modelica.Mechanics.Rotational.Interfaces.PartialTwoFlanges;
    parameter Real ratio "Speed of flange_a over speed of flange_b";
    parameter Real eta "Efficiency from flange_a to flange_b; in overrun it creates energy";
  equation
    flange_a.phi = ratio*flange_b.phi;
    0 = flange_b.tau + ratio*eta*flange_a.tau;
  end ConstantEfficiencyGear;
""",
    CONVERTER: """\
  model TorqueConverter "Steady-state map over the speed ratio; flange_a is the pump"
    extends Modelica.Mechanics.Rotational.Interfaces.PartialTwoFlanges;
    parameter Real map[:, 3] "Speed ratio, capacity [N.m.s2/rad2], torque ratio";
    Modelica.Units.SI.AngularVelocity w_pump;
    Modelica.Units.SI.AngularVelocity w_turbine;
    Modelica.Blocks.Tables.CombiTable1Ds table(
      table=map,
      columns={2, 3},
      extrapolation=Modelica.Blocks.Types.Extrapolation.HoldLastPoint);
  equation
    w_pump = der(flange_a.phi);
    w_turbine = der(flange_b.phi);
    table.u = w_turbine/w_pump;
    flange_a.tau = table.y[1]*w_pump*abs(w_pump);
    flange_b.tau = -table.y[2]*flange_a.tau;
  end TorqueConverter;
""",
}
