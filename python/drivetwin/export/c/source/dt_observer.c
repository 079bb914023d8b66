#include "dt_model.h"
