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
