// Entry points: light that clear bodies bend on its way to an event, where these are levels and balls. They know no formula.
#define BEND bend_light
#define END_BENT end_bent_light
#include "integrators/path_stages.h"
#include "elements/materials/costly"
#include "integrators/plain_bodies.h"
#include "integrators/bent_stages.h"
