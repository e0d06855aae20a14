// Entry points: light that clear bodies bend on its way to an event, where these may have any shape. They know no formula.
#define BEND bend_shapes
#define END_BENT end_bent_shapes
#include "integrators/path_stages.h"
#include "elements/materials/costly"
#include "integrators/shape_search.h"
#include "integrators/bent_stages.h"
