// What all stages include that know no formula.
#include "pictures.h"
#include "eye.h"
