// What all stages include that know no formula.
#include "pictures.h"
#include "stage.h"
#include "state.h"
#include "eye.h"
