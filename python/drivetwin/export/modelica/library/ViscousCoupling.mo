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
