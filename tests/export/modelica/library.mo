// SPDX-License-Identifier: MIT
// The equations of the components that exported models use, as the Modelica Standard Library 4.0.0
// documents them, for a compiler that has no library at hand. Friction is that of an element that
// slips: with |w| well above `band` the torque is the library's; stuck elements creep instead.
package Modelica
  package Icons
    partial package Package
    end Package;
  end Icons;

  package Units
    package SI
      type Inertia = Real(unit="kg.m2");
      type Pressure = Real(unit="Pa");
      type AngularVelocity = Real(unit="rad/s");
      type RotationalDampingConstant = Real(unit="N.m.s/rad");
    end SI;
  end Units;

  function interpolate "Linear between the rows of a table and on along its last piece"
    input Real u;
    input Real table[:, :];
    input Integer column;
    output Real y;
  protected
    Integer low;
    Integer high;
    Integer middle;
  algorithm
    low := 1;
    high := size(table, 1);
    for k in 1:14 loop
      middle := div(low + high, 2);
      high := if middle > low and table[middle, 1] > u then middle else high;
      low := if table[middle, 1] <= u then middle else low;
    end for;
    y := table[low, column] + (table[high, column] - table[low, column])
      /(table[high, 1] - table[low, 1])*max(u - table[low, 1], 0);
  end interpolate;

  function hold "Linear between the rows of a table, constant beyond"
    input Real u;
    input Real table[:, :];
    input Integer column;
    output Real y;
  algorithm
    y := interpolate(min(u, table[size(table, 1), 1]), table, column);
  end hold;

  function extend "Linear between the rows of a table and on along both end pieces"
    input Real u;
    input Real table[:, :];
    input Integer column;
    output Real y;
  algorithm
    y := interpolate(u, table, column) + (table[2, column] - table[1, column])
      /(table[2, 1] - table[1, 1])*min(u - table[1, 1], 0);
  end extend;

  package Blocks
    package Types
      type Extrapolation = enumeration(HoldLastPoint, LastTwoPoints, Periodic, NoExtrapolation);
      type Smoothness = enumeration(
          LinearSegments, ContinuousDerivative, ConstantSegments, MonotoneContinuousDerivative1,
          MonotoneContinuousDerivative2, ModifiedContinuousDerivative);
      type TimeEvents = enumeration(Always, AtDiscontinuities, NoTimeEvents);
      type Init = enumeration(NoInit, SteadyState, InitialState, InitialOutput);
    end Types;

    package Interfaces
      connector RealInput = input Real;
      connector RealOutput = output Real;
    end Interfaces;

    package Sources
      block CombiTimeTable
        parameter Integer columns[:];
        parameter Modelica.Blocks.Types.Extrapolation extrapolation;
        parameter Modelica.Blocks.Types.Smoothness smoothness;
        parameter Modelica.Blocks.Types.TimeEvents timeEvents;
        parameter Real table[:, :];
        Modelica.Blocks.Interfaces.RealOutput y[size(columns, 1)];
      equation
        for k in 1:size(columns, 1) loop
          y[k] = interpolate(time, table, columns[k]);
        end for;
      end CombiTimeTable;
    end Sources;

    package Tables
      block CombiTable1Ds
        parameter Integer columns[:];
        parameter Modelica.Blocks.Types.Extrapolation extrapolation;
        parameter Real table[:, :];
        Modelica.Blocks.Interfaces.RealInput u;
        Modelica.Blocks.Interfaces.RealOutput y[size(columns, 1)];
      equation
        for k in 1:size(columns, 1) loop
          y[k] = if extrapolation == Modelica.Blocks.Types.Extrapolation.HoldLastPoint
            then hold(u, table, columns[k]) else extend(u, table, columns[k]);
        end for;
      end CombiTable1Ds;
    end Tables;
  end Blocks;

  package Mechanics
    package Rotational
      package Interfaces
        connector Flange_a
          Real phi;
          flow Real tau;
        end Flange_a;

        connector Flange_b
          Real phi;
          flow Real tau;
        end Flange_b;

        partial model PartialTwoFlanges
          Flange_a flange_a;
          Flange_b flange_b;
        end PartialTwoFlanges;

        partial model PartialCompliantWithRelativeStates
          extends PartialTwoFlanges;
          Real phi_rel;
          Real w_rel;
          Real a_rel;
          Real tau;
        equation
          phi_rel = flange_b.phi - flange_a.phi;
          w_rel = der(phi_rel);
          a_rel = der(w_rel);
          flange_b.tau = tau;
          flange_a.tau = -tau;
        end PartialCompliantWithRelativeStates;

        partial model Slipping
          parameter Real mu_pos[:, 2];
          parameter Real peak=1;
          parameter Real cgeo=1;
          parameter Real fn_max;
          constant Real band=1e-3;
          Modelica.Blocks.Interfaces.RealInput f_normalized;
          Real w_relfric;
          Real mu;
          Real friction;
        equation
          mu = interpolate(abs(w_relfric), mu_pos, 2);
          friction = mu*cgeo*fn_max*f_normalized*tanh(w_relfric/band);
        end Slipping;
      end Interfaces;

      package Components
        model Fixed
          Interfaces.Flange_b flange;
        equation
          flange.phi = 0;
        end Fixed;

        model Inertia
          extends Interfaces.PartialTwoFlanges;
          parameter Real J;
          Real phi;
          Real w;
          Real a;
        equation
          phi = flange_a.phi;
          phi = flange_b.phi;
          w = der(phi);
          a = der(w);
          J*a = flange_a.tau + flange_b.tau;
        end Inertia;

        model IdealGear
          extends Interfaces.PartialTwoFlanges;
          parameter Real ratio;
        equation
          flange_a.phi = ratio*flange_b.phi;
          0 = ratio*flange_a.tau + flange_b.tau;
        end IdealGear;

        model LossyGear "For w_a > 0"
          extends Interfaces.PartialTwoFlanges;
          parameter Real ratio;
          parameter Real lossTable[:, 5];
          Real tauLoss;
        equation
          flange_a.phi = ratio*flange_b.phi;
          0 = flange_b.tau + ratio*(flange_a.tau - tauLoss);
          tauLoss = if flange_a.tau > 0 then (1 - lossTable[1, 2])*flange_a.tau + lossTable[1, 4]
            else (1 - 1/lossTable[1, 3])*flange_a.tau + lossTable[1, 5];
        end LossyGear;

        model IdealPlanetary
          parameter Real ratio;
          Interfaces.Flange_a sun;
          Interfaces.Flange_a carrier;
          Interfaces.Flange_b ring;
        equation
          (1 + ratio)*carrier.phi = sun.phi + ratio*ring.phi;
          ring.tau = ratio*sun.tau;
          carrier.tau = -(1 + ratio)*sun.tau;
        end IdealPlanetary;

        model SpringDamper
          extends Interfaces.PartialCompliantWithRelativeStates;
          parameter Real c;
          parameter Real d;
        equation
          tau = c*phi_rel + d*w_rel;
        end SpringDamper;

        model Clutch
          extends Interfaces.PartialCompliantWithRelativeStates;
          extends Interfaces.Slipping;
        equation
          w_relfric = w_rel;
          tau = friction;
        end Clutch;

        model Brake
          extends Interfaces.PartialTwoFlanges;
          extends Interfaces.Slipping;
          Real w;
        equation
          flange_a.phi = flange_b.phi;
          w = der(flange_a.phi);
          w_relfric = w;
          flange_a.tau + flange_b.tau - friction = 0;
        end Brake;
      end Components;

      package Sources
        model Torque
          Interfaces.Flange_b flange;
          Modelica.Blocks.Interfaces.RealInput tau;
        equation
          flange.tau = -tau;
        end Torque;

        model Torque2
          extends Interfaces.PartialTwoFlanges;
          Modelica.Blocks.Interfaces.RealInput tau;
        equation
          flange_a.tau = tau;
          flange_b.tau = -tau;
        end Torque2;

        model ConstantTorque
          Interfaces.Flange_b flange;
          parameter Real tau_constant;
        equation
          flange.tau = -tau_constant;
        end ConstantTorque;

        model QuadraticSpeedDependentTorque
          Interfaces.Flange_b flange;
          parameter Real tau_nominal;
          parameter Boolean TorqueDirection;
          parameter Real w_nominal;
          Real w;
        equation
          w = der(flange.phi);
          flange.tau = -tau_nominal*(w/w_nominal)*abs(w/w_nominal);
        end QuadraticSpeedDependentTorque;
      end Sources;
    end Rotational;
  end Mechanics;
end Modelica;
