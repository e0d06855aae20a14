// Entry point of media in a grid with planes.
#include "integrators/volume/volume.h"
#include "integrators/volume/volume_formula.h"
#include "integrators/volume/volume_medium.h"

VOLUME(volume_formula_medium)
