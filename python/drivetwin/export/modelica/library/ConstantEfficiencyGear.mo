  model ConstantEfficiencyGear "Gear with one efficiency in both directions of power"
    extends Modelica.Mechanics.Rotational.Interfaces.PartialTwoFlanges;
    parameter Real ratio "Speed of flange_a over speed of flange_b";
    parameter Real eta "Efficiency from flange_a to flange_b; in overrun it creates energy";
  equation
    flange_a.phi = ratio*flange_b.phi;
    0 = flange_b.tau + ratio*eta*flange_a.tau;
  end ConstantEfficiencyGear;
