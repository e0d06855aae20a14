// Entry point of surfaces in a grid.
#include "integrators/volume/volume.h"
#include "integrators/volume/volume_alone.h"
#include "integrators/volume/volume_surface.h"

VOLUME(volume_surface)
