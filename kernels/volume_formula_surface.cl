// Entry point of surfaces in a grid with planes, or with the formula's own normals.
#include "volume.h"
#include "volume_formula.h"
#include "volume_surface.h"

VOLUME(volume_formula_surface)
