# SPDX-License-Identifier: MIT
"""Models that the Standard Library does not have, as text; a package takes those it needs."""

from __future__ import annotations

SLIP_INERTIA = "SlipInertia"
PAPER_GEAR = "ConstantEfficiencyGear"
CONVERTER = "TorqueConverter"
SPRING_TABLE = "SpringTable"
TYRE = "TyreSlip"
LOSS_GEAR = "LossTableGear"
LOSS_PLANETARY = "LossTablePlanetary"
DRAG = "ClutchDrag"
VISCOUS = "ViscousCoupling"

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
    constant Modelica.Units.SI.AngularVelocity w_small=1e-6
      "Least pump speed that the turbine's is related to: the torque below it is nothing";
    Modelica.Units.SI.AngularVelocity w_pump;
    Modelica.Units.SI.AngularVelocity w_turbine;
    Modelica.Blocks.Tables.CombiTable1Ds table(
      table=map,
      columns={2, 3},
      extrapolation=Modelica.Blocks.Types.Extrapolation.HoldLastPoint);
  equation
    w_pump = der(flange_a.phi);
    w_turbine = der(flange_b.phi);
    table.u = w_turbine/noEvent(
      if w_pump < 0 then min(w_pump, -w_small) else max(w_pump, w_small));
    flange_a.tau = table.y[1]*w_pump*abs(w_pump);
    flange_b.tau = -table.y[2]*flange_a.tau;
  end TorqueConverter;
""",
    SPRING_TABLE: """\
  model SpringTable "Torque linear between points of twist, with a damper"
    extends Modelica.Mechanics.Rotational.Interfaces.PartialCompliantWithRelativeStates;
    parameter Real characteristic[:, 2] "Twist [rad], torque [N.m]; it goes on along its ends";
    parameter Modelica.Units.SI.RotationalDampingConstant d "Damping";
    Modelica.Blocks.Tables.CombiTable1Ds table(
      table=characteristic,
      columns={2},
      extrapolation=Modelica.Blocks.Types.Extrapolation.LastTwoPoints);
  equation
    table.u = -phi_rel;
    tau = d*w_rel - table.y[1];
  end SpringTable;
""",
    TYRE: """\
  model TyreSlip "Longitudinal force of a tyre over its slip; flange_b is the vehicle"
    extends Modelica.Mechanics.Rotational.Interfaces.PartialTwoFlanges;
    parameter Real slip_stiffness(unit="N.m") "Torque over slip";
    parameter Modelica.Units.SI.AngularVelocity w_least "Least speed that the slip is related to";
    Modelica.Units.SI.AngularVelocity w_vehicle;
    Real slip "Speed of the rim above that of the vehicle, related to the latter";
  equation
    w_vehicle = der(flange_b.phi);
    slip = (der(flange_a.phi) - w_vehicle)/noEvent(max(abs(w_vehicle), w_least));
    flange_a.tau = slip_stiffness*slip;
    flange_b.tau = -flange_a.tau;
  end TyreSlip;
""",
    LOSS_GEAR: """\
  model LossTableGear "Gear with a table of its loss torque over speed and torque of flange_a"
    extends Modelica.Mechanics.Rotational.Interfaces.PartialTwoFlanges;
    parameter Real ratio "Speed of flange_a over speed of flange_b";
    parameter Real losses[:, :] "Torques in the first column, speeds in the first row; N.m, rad/s";
    Modelica.Units.SI.AngularVelocity w;
    Modelica.Units.SI.Torque loss;
    Modelica.Blocks.Tables.CombiTable2Ds table(
      table=losses,
      extrapolation=Modelica.Blocks.Types.Extrapolation.HoldLastPoint);
  equation
    flange_a.phi = ratio*flange_b.phi;
    w = der(flange_a.phi);
    table.u1 = noEvent(if w < 0 then -flange_a.tau else flange_a.tau);
    table.u2 = noEvent(abs(w));
    loss = noEvent(if w < 0 then -table.y else table.y);
    0 = flange_b.tau + ratio*(flange_a.tau - loss);
  end LossTableGear;
""",
    LOSS_PLANETARY: """\
  model LossTablePlanetary "Planetary set with a table of its loss torque between sun and carrier"
    parameter Real ratio "Ring over sun teeth";
    parameter Real losses[:, :] "Torques in the first column, speeds in the first row; N.m, rad/s";
    Modelica.Mechanics.Rotational.Interfaces.Flange_a sun;
    Modelica.Mechanics.Rotational.Interfaces.Flange_a carrier;
    Modelica.Mechanics.Rotational.Interfaces.Flange_b ring;
    Modelica.Units.SI.AngularVelocity w "Speed of the sun relative to the carrier";
    Modelica.Units.SI.Torque loss;
    Modelica.Blocks.Tables.CombiTable2Ds table(
      table=losses,
      extrapolation=Modelica.Blocks.Types.Extrapolation.HoldLastPoint);
  equation
    (1 + ratio)*carrier.phi = sun.phi + ratio*ring.phi;
    w = der(sun.phi) - der(carrier.phi);
    table.u1 = noEvent(if w < 0 then -sun.tau else sun.tau);
    table.u2 = noEvent(abs(w));
    loss = noEvent(if w < 0 then -table.y else table.y);
    ring.tau = ratio*(sun.tau - loss);
    carrier.tau = -(sun.tau + ring.tau);
  end LossTablePlanetary;
""",
    DRAG: """\
  model ClutchDrag "Drag torque of a clutch over its slip"
    extends Modelica.Mechanics.Rotational.Interfaces.PartialCompliantWithRelativeStates;
    parameter Real drag[:, 2] "Slip [rad/s] from zero on, torque [N.m]";
    Modelica.Blocks.Tables.CombiTable1Ds table(
      table=drag,
      columns={2},
      extrapolation=Modelica.Blocks.Types.Extrapolation.HoldLastPoint);
  equation
    table.u = noEvent(abs(w_rel));
    tau = noEvent(if w_rel < 0 then -table.y[1] else table.y[1]);
  end ClutchDrag;
""",
    VISCOUS: """\
  model ViscousCoupling "Torque linear between points of the slip"
    extends Modelica.Mechanics.Rotational.Interfaces.PartialCompliantWithRelativeStates;
    parameter Real characteristic[:, 2] "Slip [rad/s], torque [N.m]; it goes on along its ends";
    Modelica.Blocks.Tables.CombiTable1Ds table(
      table=characteristic,
      columns={2},
      extrapolation=Modelica.Blocks.Types.Extrapolation.LastTwoPoints);
  equation
    table.u = w_rel;
    tau = table.y[1];
  end ViscousCoupling;
""",
}
