  model SlipInertia "Inertia that turns with the relative speed of two flanges"
    extends Modelica.Mechanics.Rotational.Interfaces.PartialCompliantWithRelativeStates;
    parameter Modelica.Units.SI.Inertia J "Inertia";
  equation
    tau = J*a_rel;
  end SlipInertia;
