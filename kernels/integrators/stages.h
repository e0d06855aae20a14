// What all stages include that know no formula.
#include "integrators/pictures.h"
#include "integrators/eye.h"
