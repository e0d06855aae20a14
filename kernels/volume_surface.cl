// Entry point of surfaces in a grid.
#include "volume.h"
#include "volume_alone.h"
#include "volume_surface.h"

VOLUME(volume_surface)
