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
