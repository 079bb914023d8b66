/* SPDX-License-Identifier: MIT */
#ifndef RAMPS_H
#define RAMPS_H

double clamp(double value, double low, double high);
double ramp_up(double value, double target, double step);
double ramp_down(double value, double target, double step);

#endif
