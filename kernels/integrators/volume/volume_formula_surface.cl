// Entry point of surfaces in a grid with planes, or with the formula's own normals.
#include "integrators/volume/volume.h"
#include "integrators/volume/volume_formula.h"
#include "integrators/volume/volume_surface.h"

VOLUME(volume_formula_surface)
