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
