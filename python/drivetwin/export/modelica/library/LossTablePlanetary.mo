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
