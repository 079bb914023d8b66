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
