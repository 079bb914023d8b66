/* SPDX-License-Identifier: MIT */
#include "ramps.h"

double clamp(double value, double low, double high)
{
    return value < low ? low : value > high ? high : value;
}

double ramp_up(double value, double target, double step)
{
    return value + step < target ? value + step : target;
}

double ramp_down(double value, double target, double step)
{
    return value - step > target ? value - step : target;
}
