// Entry point of media in a grid.
#include "integrators/volume/volume.h"
#include "integrators/volume/volume_alone.h"
#include "integrators/volume/volume_medium.h"

VOLUME(volume_medium)
