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
